import { describe, expect, test } from "vitest";

import { hashOf, placeOf } from "../../src/store/permalink";

describe("an address", () => {
  test("says what it was made of", () => {
    const place = { map: "direct", pixel: { x: 81, y: 20 }, time_ns: 11.74, view: "streak" };
    expect(hashOf(place)).toBe("#map=direct&pixel=81,20&time_ns=11.74&view=streak");
    expect(placeOf(hashOf(place))).toEqual(place);
  });

  test("of two maps says both", () => {
    expect(hashOf({ map: "direct", map2: "indirect" })).toBe("#map=direct&map2=indirect");
    expect(placeOf("#map=direct&map2=indirect")).toEqual({ map: "direct", map2: "indirect" });
    expect(placeOf("#map2=gone")).toEqual({});
  });

  test("of a recording says which, and which frame", () => {
    const place = { recording: "20261120T081500Z-3f9c2a", frame: 17 };
    expect(hashOf(place)).toBe("#recording=20261120T081500Z-3f9c2a&frame=17");
    expect(placeOf(hashOf(place))).toEqual(place);
    expect(hashOf({ frame: 17 })).toBe("");
    expect(placeOf("#recording=x&frame=-2")).toEqual({ recording: "x" });
  });

  test("that is handed on says the layout, and the looks that were chosen", () => {
    const place = {
      layout: [
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
      ],
      looks: { range: { colours: "cividis", kind: "linear", limits: { low: 1, high: 3.5 } }, direct: { colours: "grey", kind: "logarithmic", limits: null } },
    } as const;
    expect(hashOf(place)).toBe("#layout=2:map.1,0.5_transient.3_streak.1/1:response.1&look=range,cividis,linear,1,3.5&look=direct,grey,logarithmic");
    expect(placeOf(hashOf(place))).toEqual(place);
  });

  test("that is handed on says what is shown of pixel and light, pins, a region and the part in sight", () => {
    const place = {
      side: "cumulative",
      light: { play: "gate", colours: "grey", tone: "linear", stops: -2, backdrop: false },
      pins: [
        { name: "A", x: 30, y: 40 },
        { name: "C", x: 5, y: 6 },
      ],
      region: { x0: 50, y0: 40, x1: 69, y1: 54 },
      sight: { zoom: 4, left: 0.25, top: 0.1 },
    } as const;
    expect(hashOf(place)).toBe("#side=cumulative&light=gate,grey,linear,-2,black&pins=A30,40/C5,6&region=50,40/69,54&sight=4,0.25,0.1");
    expect(placeOf(hashOf(place))).toEqual(place);
    const polygon = {
      region: {
        x0: 30,
        y0: 20,
        x1: 90,
        y1: 50,
        corners: [
          { x: 30, y: 20 },
          { x: 90, y: 20 },
          { x: 60, y: 50 },
        ],
      },
    };
    expect(placeOf(hashOf(polygon))).toEqual(polygon);
  });

  test.each([
    "#side=secret",
    "#light=gate,neon,root,0,scene",
    "#light=gate,grey,root,x,scene",
    "#pins=D1,2/A1",
    "#region=1,2",
    "#sight=0.5,0,0",
    "#sight=4,x,0",
    "#layout=1:secret.1",
    "#layout=:,/",
    "#layout=1:map.-1",
    "#layout=1:map.1,1_map.1",
    "#layout=1:1_",
    "#look=range,neon,linear",
    "#look=range,viridis,linear,3,1",
    "#look=secret,viridis,linear",
    "#look=,",
  ])("with a layout or a look that makes no sense says nothing: %s", (hash) => expect(placeOf(hash)).toEqual({}));

  test("of nothing is empty", () => {
    expect(hashOf({})).toBe("");
    expect(placeOf("")).toEqual({});
  });

  test.each(["#map=gone", "#pixel=1", "#pixel=-1,2", "#pixel=1,2,3", "#time_ns=1e999", "#time_ns=x", "#time_ns=-3", "#view=secret", "#recording=../../etc", "#frame=3", "#%%%"])(
    "that makes no sense says nothing: %s",
    (hash) => expect(placeOf(hash)).toEqual({}),
  );
});
