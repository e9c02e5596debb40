import { describe, expect, test } from "vitest";

import { hashOf, placeOf } from "../../src/store/permalink";

describe("an address", () => {
  test("says what it was made of", () => {
    const place = { map: "direct", pixel: { x: 81, y: 20 }, time_ns: 11.74, view: "streak" };
    expect(hashOf(place)).toBe("#map=direct&pixel=81,20&time_ns=11.74&view=streak");
    expect(placeOf(hashOf(place))).toEqual(place);
  });

  test("of a recording says which, and which frame", () => {
    const place = { recording: "20261120T081500Z-3f9c2a", frame: 17 };
    expect(hashOf(place)).toBe("#recording=20261120T081500Z-3f9c2a&frame=17");
    expect(placeOf(hashOf(place))).toEqual(place);
    expect(hashOf({ frame: 17 })).toBe("");
    expect(placeOf("#recording=x&frame=-2")).toEqual({ recording: "x" });
  });

  test("of nothing is empty", () => {
    expect(hashOf({})).toBe("");
    expect(placeOf("")).toEqual({});
  });

  test.each(["#map=gone", "#pixel=1", "#pixel=-1,2", "#pixel=1,2,3", "#time_ns=1e999", "#time_ns=x", "#time_ns=-3", "#view=secret", "#recording=../../etc", "#frame=3", "#%%%"])(
    "that makes no sense says nothing: %s",
    (hash) => {
      expect(placeOf(hash)).toEqual({});
    },
  );
});
