import { expect, test } from "vitest";
import { LAYOUTS } from "../../../client/dashboard/src/store/layout";
import { Store } from "../../../client/dashboard/src/store/store";
import { SHORTCUTS } from "../../../client/dashboard/src/ui/shortcuts";

function press(store: Store, key: string, shiftKey = false): void {
  SHORTCUTS.find(({ keys }) => keys.includes(key))?.run(store, { key, shiftKey } as KeyboardEvent);
}

test("no key has two meanings", () => {
  const keys = SHORTCUTS.flatMap((shortcut) => shortcut.keys);
  expect(new Set(keys).size).toBe(keys.length);
});

test("keys move the light, its speed, the map, the layout and the colours", () => {
  const store = new Store({ shelf: null });
  press(store, "ArrowRight", true);
  expect(store.player.time_s.value).toBeCloseTo(1e-9, 15);
  press(store, "Home");
  expect(store.player.time_s.value).toBe(0);
  const speed = store.player.speed_ns.value;
  press(store, ".");
  expect(store.player.speed_ns.value).toBeGreaterThan(speed);
  for (let n = 0; n < 20; n++) press(store, ",");
  expect(store.player.speed_ns.value).toBe(0.5);
  press(store, "2");
  expect(store.mapProduct.value).toBe("direct");
  press(store, "t");
  expect(store.theme.choice.value).toBe("light");
  press(store, "?");
  expect(store.dialog.value).toBe("help");
});

test("layouts follow each other in a circle, whichever is on screen", () => {
  const store = new Store({ shelf: null });
  const seen = Object.keys(LAYOUTS).map(() => {
    press(store, "l");
    return store.layout.value;
  });
  expect(new Set(seen)).toEqual(new Set(Object.values(LAYOUTS)));
});
