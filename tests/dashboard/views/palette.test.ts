import { describe, expect, test } from "vitest";
import { LAYOUTS } from "../../../client/dashboard/src/store/layout";
import { Store } from "../../../client/dashboard/src/store/store";
import { commandsOf, matching } from "../../../client/dashboard/src/views/palette/commands";

describe("a search of commands", () => {
  const commands = ["Map: Range", "Map: Direct", "Layout: Six views", "Scene: mirrors", "Map: Indirect"].map((words) => ({ words }));
  const found = (query: string): string[] => matching(commands, query).map(({ words }) => words);

  test("finds those that hold all words, first those at whose beginning one stands", () => {
    expect(found("direct")).toEqual(["Map: Direct", "Map: Indirect"]);
    expect(found("views SIX")).toEqual(["Layout: Six views"]);
    expect(found("six mirrors")).toEqual([]);
    expect(found("  ")).toHaveLength(5);
  });
});

describe("commands", () => {
  const run = (store: Store, words: string): void =>
    commandsOf(store)
      .find((command) => command.words === words)
      ?.run();

  test("show maps, layouts and views", () => {
    const store = new Store({ shelf: null });
    run(store, "Map: Validity");
    run(store, "Layout: Projector");
    run(store, "Show alone: Streak");
    expect([store.mapProduct.value, store.layout.value, store.alone.value]).toEqual(["validity", LAYOUTS.Projector, "streak"]);
    run(store, "Layout: Overview");
    expect(store.alone.value).toBeNull();
  });

  const words = "help distance roi histogram screenshot export compare exposure colormap 3d fullscreen series share".split(" ");
  test.each(words)("are found by the plain word %s", (word) => {
    expect(matching(commandsOf(new Store({ shelf: null })), word)).not.toEqual([]);
  });

  test("have words of their own each, and a key where a key does the same", () => {
    const commands = commandsOf(new Store({ shelf: null }));
    expect(new Set(commands.map(({ words }) => words)).size).toBe(commands.length);
    expect(commands.find(({ words }) => words === "Map: Direct")?.key).toBe("2");
    expect(commands.some(({ words }) => words.startsWith("Scene:"))).toBe(false); // no simulated camera is known
  });
});
