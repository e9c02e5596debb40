import { beforeEach, describe, expect, test, vi } from "vitest";

import { Api } from "../../../client/dashboard/src/store/api";
import { copyLink, keepAddress, share } from "../../../client/dashboard/src/store/permalink";
import { Store } from "../../../client/dashboard/src/store/store";
import type { AppliedDocument, FrameMeta, RecordingDocument } from "../../../client/dashboard/src/stream/documents";
import { SIDE } from "../../../client/dashboard/src/views/response/sides";

class FakeWindow {
  readonly location = { hash: "", href: "http://lab:8000/" };
  readonly copied: string[] = [];
  readonly history = { state: null, replaceState: (_state: unknown, _title: string, hash: string) => (this.location.hash = hash) };
  readonly navigator = { clipboard: { writeText: (text: string) => Promise.resolve(void this.copied.push(text)) } };
  #follow = (): void => undefined;

  addEventListener(_kind: string, follow: () => void): void {
    this.#follow = follow;
  }

  goto(hash: string): void {
    this.location.hash = hash;
    this.#follow();
  }
}

const refused = new Api(() => Promise.resolve(Response.json({ title: "Not here" }, { status: 404 })));

/** The page behind an address, its window, and which recordings it was to open. */
function page(hash = "") {
  const target = new FakeWindow();
  target.location.hash = hash;
  const store = new Store({ shelf: null, api: refused });
  const opened = vi.spyOn(store.replay, "open").mockResolvedValue();
  keepAddress(target as unknown as Window, store);
  store.sequence.value = { base_frequency_hz: 25e6 } as AppliedDocument;
  vi.advanceTimersByTime(1000);
  const copied = async (): Promise<string> => {
    await copyLink(target as unknown as Window, store);
    return new URL(target.copied.at(-1) ?? "").hash;
  };
  return { store, target, opened, copied };
}

beforeEach(() => void vi.useFakeTimers());

describe("an address", () => {
  const ADDRESS = "#map=direct&pixel=81,20&time_ns=11.74&view=streak";

  test("is gone to, and is still the address afterwards", () => {
    const { store, target } = page(ADDRESS);
    expect([store.mapProduct.value, store.selected.value, store.alone.value]).toEqual(["direct", { x: 81, y: 20 }, "streak"]);
    expect(store.player.time_s.value).toBeCloseTo(11.74e-9, 15);
    expect(new Set(target.location.hash.slice(1).split("&"))).toEqual(new Set(ADDRESS.slice(1).split("&")));
  });

  test("follows what is looked at, and is followed when it changes", () => {
    const { store, target } = page();
    store.mapProduct.value = "indirect";
    store.selected.value = { x: 40, y: 30 };
    vi.advanceTimersByTime(1000);
    expect(target.location.hash).toBe("#map=indirect&pixel=40,30");
    target.goto("#map=range&pixel=7,8");
    expect([store.mapProduct.value, store.selected.value]).toEqual(["range", { x: 7, y: 8 }]);
  });

  test("that is gone to is followed, though another was about to be written", () => {
    const { store, target } = page();
    store.mapProduct.value = "indirect";
    target.location.hash = "#map=direct"; // its event is still to come
    vi.advanceTimersByTime(1000);
    target.goto("#map=direct");
    expect(store.mapProduct.value).toBe("direct");
  });

  test("has the second map while it is shown", () => {
    const { store, target } = page("#map=direct&map2=validity&layout=1:map.1,second-map.1");
    expect(store.secondMapProduct.value).toBe("validity");
    store.mapProduct.value = "range";
    vi.advanceTimersByTime(1000);
    expect(target.location.hash).toBe("#map=range&map2=validity");
    target.goto("#map2=9");
    expect(store.secondMapProduct.value).toBe("validity");
  });

  test("of a recording says which, and which frame; without it the camera is shown", () => {
    const { store, target, opened } = page("#recording=20261120T081500Z-3f9c2a&frame=17");
    expect(opened).toHaveBeenLastCalledWith("20261120T081500Z-3f9c2a", 17);
    store.replay.recording.value = { id: "20261120T081500Z-3f9c2a" } as RecordingDocument;
    store.replay.frame.value = 18;
    vi.advanceTimersByTime(1000);
    expect(target.location.hash).toBe("#map=range&recording=20261120T081500Z-3f9c2a&frame=18");
    store.replay.playing.value = true;
    vi.advanceTimersByTime(1000);
    expect(target.location.hash).toBe("#map=range&recording=20261120T081500Z-3f9c2a");
    target.goto("#frame=3");
    expect(store.replay.recording.value).toBeNull();
    target.goto("#recording=x&frame=-2");
    expect(opened).toHaveBeenLastCalledWith("x", undefined);
  });
});

describe("a copied link", () => {
  test("says the layout, and the looks that were chosen", async () => {
    const said = "layout=2:map.1,0.5_transient.3_streak.1/1:response.1&look=range,cividis,linear,1,3.5&look=direct,grey,logarithmic";
    const { store, copied } = page(`#${said}`);
    expect(store.layout.value).toEqual([
      {
        share: 2,
        slots: [
          { view: "map", share: 1 },
          {
            share: 0.5,
            slots: [
              { view: "transient", share: 3 },
              { view: "streak", share: 1 },
            ],
          },
        ],
      },
      { share: 1, slots: [{ view: "response", share: 1 }] },
    ]);
    const [range, direct] = [store.looks.of("range"), store.looks.of("direct")];
    expect([range.colours.value, range.kind.value, range.manual.value]).toEqual(["cividis", "linear", { low: 1, high: 3.5 }]);
    expect([direct.colours.value, direct.kind.value, direct.manual.value]).toEqual(["grey", "logarithmic", null]);
    expect(await copied()).toContain(said);
  });

  test("says what is shown of pixel and light, pins, a region and the part in sight", async () => {
    const NOTE = "a/b, 50 % & <i>#";
    const parts = [
      "side=cumulative",
      "light=gate,grey,linear,-2,black",
      `pins=A30,40/C5,6,${encodeURIComponent(encodeURIComponent(NOTE))}`,
      "region=50,40/69,54",
      "sight=4,0.25,0.1",
    ];
    const { store, copied, target } = page(`#${parts.join("&")}`);
    const { play, colours, tone, stops, backdrop } = store.light;
    expect(store.settings.of(SIDE).value).toBe("cumulative");
    expect([play, colours, tone, stops, backdrop].map(({ value }) => value)).toEqual(["gate", "grey", "linear", -2, false]);
    expect(store.measures.pins.value).toEqual([
      { name: "A", x: 30, y: 40 },
      { name: "C", x: 5, y: 6, note: NOTE },
    ]);
    expect(store.measures.region.value).toEqual({ x0: 50, y0: 40, x1: 69, y1: 54 });
    expect(store.viewport.view.value).toEqual({ zoom: 4, left: 0.25, top: 0.1 });
    expect((await copied()).slice(1).split("&")).toEqual(expect.arrayContaining(parts));
    target.goto("#region=30,20/90,20/60,50");
    const corners = [
      { x: 30, y: 20 },
      { x: 90, y: 20 },
      { x: 60, y: 50 },
    ];
    expect(store.measures.region.value).toEqual({ x0: 30, y0: 20, x1: 90, y1: 50, corners });
    expect(await copied()).toContain("region=30,20/90,20/60,50");
  });
});

test.each([
  ...[
    "#side=secret",
    "#light=gate,neon,root,0,scene",
    "#light=gate,grey,root,x,scene",
    "#pins=D1,2/A1",
    "#region=1,2",
    "#sight=0.5,0,0",
    "#sight=4,x,0",
  ],
  ...["#layout=1:secret.1", "#layout=:,/", "#layout=1:map.-1", "#layout=1:map.1,1_map.1", "#layout=1:1_"],
  ...["#look=range,neon,linear", "#look=range,viridis,linear,3,1", "#look=secret,viridis,linear", "#look=,"],
  ...[
    "#map=9",
    "#pixel=1",
    "#pixel=-1,2",
    "#pixel=1,2,3",
    "#time_ns=1e999",
    "#time_ns=x",
    "#time_ns=-3",
    "#view=secret",
    "#recording=../../etc",
    "#frame=3",
    "#%%%",
    "",
  ],
])("an address that makes no sense says nothing: %s", async (hash) => {
  const { copied, opened } = page(hash);
  const { copied: plain } = page();
  expect(await copied()).toBe(await plain());
  expect(opened).not.toHaveBeenCalled();
});

describe("sharing", () => {
  test("holds the frame, has the service keep it, and copies a link to it", async () => {
    const { store, target } = page("#pixel=81,20");
    const start = vi.spyOn(store.recordings, "start").mockResolvedValue({ id: "kept-1" } as RecordingDocument);
    store.player.playing.value = true;
    store.status.newest.value = { frame: 41 } as FrameMeta;
    await share(target as unknown as Window, store);
    expect(start).toHaveBeenCalledWith(expect.objectContaining({ frame: 41 }));
    expect([store.held.value, store.player.playing.value]).toEqual([true, false]);
    expect(new URL(target.copied.at(-1) ?? "").hash).toMatch(/pixel=81,20.*&recording=kept-1&frame=1$/);
  });

  test("copies nothing where the service refuses, and says why", async () => {
    const { store, target } = page();
    store.status.newest.value = { frame: 41 } as FrameMeta;
    await share(target as unknown as Window, store); // no service knows it here
    expect(target.copied).toEqual([]);
    expect(store.events.all.value.at(-1)).toMatchObject({ words: "Not here", tone: "bad" });
  });
});
