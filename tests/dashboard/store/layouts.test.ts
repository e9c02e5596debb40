import { signal } from "@preact/signals";
import { describe, expect, test } from "vitest";
import { closed, LAYOUTS, type Layout, OVERVIEW, split } from "../../../client/dashboard/src/store/layout";
import { Layouts } from "../../../client/dashboard/src/store/layouts";
import { Settings } from "../../../client/dashboard/src/store/settings";
import { Store } from "../../../client/dashboard/src/store/store";

describe("changes of the layout", () => {
  test("are undone one by one, and undoing is none", () => {
    const current = signal<Layout>(OVERVIEW);
    const layouts = new Layouts(new Settings(null), current);
    expect(layouts.undoable.value).toBe(false);
    const three = closed(OVERVIEW, "sequence");
    current.value = three;
    current.value = LAYOUTS.Steering;
    layouts.undo();
    expect(current.value).toBe(three);
    layouts.undo();
    expect(current.value).toBe(OVERVIEW);
    expect(layouts.undoable.value).toBe(false);
    layouts.undo();
    expect(current.value).toBe(OVERVIEW);
  });

  test("by a splitter are one, however far it was drawn", () => {
    const current = signal<Layout>(OVERVIEW);
    const layouts = new Layouts(new Settings(null), current);
    for (const place of [0.4, 0.5, 0.6]) current.value = current.value.map((row) => ({ ...row, slots: split(row.slots, 0, place) }));
    layouts.undo();
    expect(current.value).toBe(OVERVIEW);
    expect(layouts.undoable.value).toBe(false);
  });
});

describe("layouts under names", () => {
  test("are remembered, replaced and removed", () => {
    const kept = new Map<string, string>();
    const shelf = { getItem: (key: string) => kept.get(key) ?? null, setItem: (key: string, text: string) => void kept.set(key, text) };
    const store = new Store({ shelf });
    store.layouts.save("bench");
    store.showLayout(LAYOUTS.Projector);
    store.layouts.save("wall");
    expect(new Store({ shelf }).layouts.named.value).toEqual({ bench: OVERVIEW, wall: LAYOUTS.Projector });
    store.layouts.save("bench");
    store.layouts.remove("wall");
    expect(new Store({ shelf }).layouts.named.value).toEqual({ bench: LAYOUTS.Projector });
  });

  test.each(["[3]", '{"bench": 1}', "null", "{"])("that make no sense are not there: %s", (text) => {
    const shelf = { getItem: (key: string) => (key.endsWith(".layouts") ? text : null), setItem: () => undefined };
    expect(new Store({ shelf }).layouts.named.value).toEqual({});
  });
});
