import { decode, encode } from "@msgpack/msgpack";
import { describe, expect, test } from "vitest";
import { decodeMessage, encodeAck, encodeSubscribe, type FrameMessage, ProtocolError } from "../../../client/dashboard/src/stream/protocol";
import specification from "../../../docs/stream.md?raw";

/** The bytes recorded in the specification, which the service is held to as well. */
function recorded(name: string): ArrayBuffer {
  const block = new RegExp(`\`\`\`hex ${name}\n([0-9a-f\\s]+)\`\`\``).exec(specification);
  if (block === null) throw new Error(`docs/stream.md records no ${name}`);
  return Uint8Array.from(block[1].trim().split(/\s+/), (byte) => parseInt(byte, 16)).buffer;
}

function frame(changes: Record<string, unknown>): ArrayBuffer {
  const array = { dtype: "<f4", shape: [2], data: new Uint8Array(8), ...changes };
  return encode({ v: 1, type: "frame", product: "range", array }).slice().buffer;
}

describe("messages of the service", () => {
  test("a recorded frame is read in place, without copying its data", () => {
    const buffer = recorded("frame");
    const message = decodeMessage(buffer) as FrameMessage;
    expect(message.product).toBe("range");
    expect(message.unit).toBe("m");
    expect(message.meta.frame).toBe(17);
    expect(message.array.shape).toEqual([2, 2]);
    expect([...message.array.data]).toEqual([1.5, NaN, 2.25, -0]);
    expect(message.array.data.buffer).toBe(buffer);
  });

  test("a recorded hello, notice and error are read as they are", () => {
    expect(decodeMessage(recorded("hello"))).toMatchObject({ type: "hello", camera: { state: "streaming" } });
    expect(decodeMessage(recorded("notice"))).toMatchObject({ kind: "dropped", channel: 0, count: 3, total: 17 });
    expect(decodeMessage(recorded("error"))).toMatchObject({ problem: { status: 422, field: "v" } });
  });

  test("one pixel of a frame announces all of them, and of the frame of a single pixel it is all", () => {
    const meta = { frame: 3, width: 640, height: 480, region: [0, 0, 1, 1], decimation: 1 };
    const array = { dtype: "<f4", shape: [7, 1, 1], data: new Uint8Array(28) };
    const announcement = decodeMessage(encode({ type: "frame", product: "coefficients", meta, array }).slice().buffer);
    expect(announcement).toEqual({ type: "announcement", frame: 3, product: "coefficients" });
    const single = { ...meta, width: 1, height: 1 };
    expect(decodeMessage(encode({ type: "frame", product: "coefficients", meta: single, array }).slice().buffer)).toMatchObject({
      type: "frame",
    });
  });

  test("data that is not aligned is copied to where it is", () => {
    const values = new Float32Array([3.5, -7]);
    for (const pad of ["", "a", "ab", "abc"]) {
      const array = { dtype: "<f4", shape: [2], data: new Uint8Array(values.buffer) };
      const message = decodeMessage(encode({ type: "frame", pad, array }).slice().buffer) as FrameMessage;
      expect([...message.array.data]).toEqual([3.5, -7]);
    }
  });

  test.each([
    ["<f8", new Float64Array([1 / 3, NaN])],
    ["<u2", new Uint16Array([4095, 0])],
    ["|u1", new Uint8Array([1, 16])],
  ] as const)("an array of %s keeps its values", (dtype, values) => {
    const message = decodeMessage(frame({ dtype, data: new Uint8Array(values.buffer) })) as FrameMessage;
    expect([...message.array.data]).toEqual([...values]);
  });

  test("complex numbers are pairs", () => {
    const pairs = new Float32Array([1, 2, 3, 4]);
    const message = decodeMessage(frame({ dtype: "<c8", data: new Uint8Array(pairs.buffer) })) as FrameMessage;
    expect([...message.array.data]).toEqual([1, 2, 3, 4]);
  });

  test("the recorded codes of 16 bits are the values that the specification states", () => {
    const [range] = [decodeMessage(recorded("u16")) as FrameMessage];
    expect(range.array).toMatchObject({ dtype: "<f4", shape: [2, 2] });
    [1, NaN, 1.99994, 0].forEach((value, at) =>
      Number.isNaN(value) ? expect(range.array.data[at]).toBeNaN() : expect(range.array.data[at]).toBeCloseTo(value, 5),
    );
    const { array } = decodeMessage(recorded("reflection16")) as FrameMessage;
    expect(array).toMatchObject({ dtype: "<f4", shape: [3, 1, 2] });
    const [energy, , re, , im] = array.data;
    expect(energy).toBeCloseTo(3, 3);
    expect(re).toBeCloseTo(-0.5, 4);
    expect(im).toBeCloseTo(0, 6);
    expect(array.data[1]).toBeNaN();
  });

  test("part of a picture stands where it belongs in the whole", () => {
    const data = new Uint8Array(Float32Array.from([1, 2, 3, 4]).buffer);
    const meta = { region: [1, 0, 3, 3], decimation: 2, width: 5, height: 3 };
    const message = decodeMessage(
      encode({ type: "frame", meta, array: { dtype: "<f4", shape: [2, 2], data } }).slice().buffer,
    ) as FrameMessage;
    expect(message.array.shape).toEqual([3, 5]);
    expect([...message.array.data]).toEqual([NaN, 1, NaN, 2, NaN, NaN, NaN, NaN, NaN, NaN, NaN, 3, NaN, 4, NaN]);
  });

  test("a kind of message from a later service is passed over", () =>
    expect(decodeMessage(encode({ type: "poem" }).slice().buffer)).toBeNull());

  test.each([
    ["no msgpack", new Uint8Array([0xc1]).buffer, /not msgpack/],
    ["a message cut short", recorded("frame").slice(0, 60), /not msgpack/],
    ["no map", encode([1, 2]).slice().buffer, /not a map/],
    ["an unknown dtype", frame({ dtype: "|O" }), /\|O/],
    ["data shorter than its shape", frame({ shape: [3] }), /without its 12 bytes/],
    ["a negative length", frame({ shape: [-1, -2] }), /without a shape/],
    [
      "an encoding that is not known",
      encode({ type: "frame", encoding: "u8", array: { dtype: "|u1", shape: [1], data: new Uint8Array(1) } }).slice().buffer,
      /encoded as u8/,
    ],
    ["a frame without an array", encode({ type: "frame" }).slice().buffer, /without an array/],
  ])("%s is refused with a sentence", (_what, buffer, sentence) => {
    expect(() => decodeMessage(buffer)).toThrow(ProtocolError);
    expect(() => decodeMessage(buffer)).toThrow(sentence);
  });
});

describe("messages to the service", () => {
  test("an acknowledgement has the recorded bytes", () => expect(encodeAck(17)).toEqual(new Uint8Array(recorded("ack"))));

  test("a subscription has the form of the recorded one", () => {
    const form = decode(recorded("subscribe")) as { subscriptions: { product: string }[] };
    const subscriptions = form.subscriptions.map(({ product }) => ({ product, max_rate_hz: null }));
    const sent = decode(encodeSubscribe(subscriptions, 2));
    expect(sent).toEqual({ ...form, subscriptions });
  });
});
