import { expect, test } from "vitest";
import { isLayout, LAYOUT } from "../../../client/dashboard/src/store/layout";
import { MAP_PRODUCTS } from "../../../client/dashboard/src/store/mapCatalogue";
import { VIEW_NAMES } from "../../../client/dashboard/src/store/viewNames";
import { EXAMPLES } from "../../../client/dashboard/src/views/examples/examples";
import page from "../../../docs/start.md?raw";

test("the documentation links every example, as it is", () => {
  const linked = [...page.matchAll(/\[([^\]]*)\]\(http:\/\/127\.0\.0\.1:8000\/#([^)]*)\)/g)].map(([, name, state]) => [name, state]);
  expect(linked).toEqual(EXAMPLES.map(({ name, state }) => [name, state]));
});

test("what an example says of views, layouts and maps is there", () => {
  expect(EXAMPLES).toHaveLength(6);
  for (const { state } of EXAMPLES) {
    const said = new URLSearchParams(state);
    const layout = said.get("layout");
    if (layout !== null) expect(isLayout(LAYOUT.parse?.(layout))).toBe(true);
    else expect(VIEW_NAMES).toContain(said.get("view"));
    for (const map of ["map", "map2"]) {
      if (said.has(map)) expect(MAP_PRODUCTS.map(({ product }) => product)).toContain(said.get(map));
    }
  }
});
