/**
 * Messages of `WS /api/v1/stream`, subprotocol transientcam.v1.msgpack: types and codec.
 *
 * The service may add fields; unknown ones are ignored, unknown kinds of messages too.
 */
import { decode, encode } from "@msgpack/msgpack";

import { decodeReflection16, decodeU16, type Numbers, whole } from "./compact";
import type { AppliedDocument, CameraDocument, FrameMeta, ProblemDocument, SequenceDocument, Notice as StatedNotice } from "./documents";

export const SUBPROTOCOL = "transientcam.v1.msgpack";

export type Dtype = "<f4" | "<f8" | "<c8" | "<u2" | "|u1";

/** An array in C order. Complex numbers ("<c8") lie as pairs of float32: real, imaginary. */
export type NdArray = Readonly<{ dtype: Dtype; shape: readonly number[]; data: Numbers }>;

/** What the camera is doing, in the service's words. */
export type CameraState = CameraDocument["state"];

/** A sequence as it is asked for; what is absent takes its default. */
export type SequenceRequest = Partial<SequenceDocument>;

export type Zeroth = SequenceDocument["zeroth"];
export type TakeOrder = SequenceDocument["take_order"];

export interface Hello {
  readonly type: "hello";
  /** What the frames of each subscription are like. */
  readonly channels?: readonly { readonly product: string; readonly shape: readonly number[] }[];
  readonly session: string;
  readonly server: { readonly name: string; readonly version: string };
  readonly sequence: AppliedDocument | null;
  readonly camera: { readonly state: CameraState };
}

export interface FrameMessage {
  readonly type: "frame";
  readonly product: string;
  readonly unit: string;
  readonly axes: readonly string[];
  readonly meta: FrameMeta;
  readonly encode_s: number;
  readonly array: NdArray;
}

type SequenceChanged = Extract<StatedNotice, { kind: "sequence-changed" }>;

/** An event; the sequence in it is the document that REST answers. */
export type Notice = Exclude<StatedNotice, SequenceChanged> | (Omit<SequenceChanged, "sequence"> & { readonly sequence: AppliedDocument });

export type ErrorMessage = Readonly<{ type: "error"; problem: Problem }>;

/** RFC 9457, with the extensions of this service; what the page itself finds wrong has fewer fields. */
export interface Problem extends Partial<ProblemDocument> {
  /** Of a plan for a camera of fixed frequencies: what takes give. */
  readonly takes?: readonly { readonly takes: number; readonly capture_s: number; readonly range_std_m: number }[];
}

/** Why the service refused; of a proxy's page in the place of a problem the status has to do. */
export async function problemOf(answer: Response): Promise<Problem> {
  const problem: Problem = { title: `The service answered ${answer.status} ${answer.statusText}.`, status: answer.status };
  return { ...problem, ...((await answer.json().catch(() => ({}))) as Problem) };
}

/** A frame has this product: of its array one pixel came, and the rest is to be requested. */
export type AnnouncementMessage = Readonly<{ type: "announcement"; frame: number; product: string }>;

export type ServerMessage = Hello | FrameMessage | AnnouncementMessage | Notice | ErrorMessage;

/** The part of a picture that announces the whole of it. */
export const ANNOUNCING: readonly number[] = [0, 0, 1, 1];

/** The service sent something this page cannot read. */
export class ProtocolError extends Error {
  override readonly name = "ProtocolError";
}

const ITEM_BYTES: Record<Dtype, number> = { "<f4": 4, "<f8": 8, "<c8": 8, "<u2": 2, "|u1": 1 };

/** Reads a message. Its arrays are views into `buffer` wherever the data is aligned. */
export function decodeMessage(buffer: ArrayBuffer): ServerMessage | null {
  let message: unknown;
  try {
    message = decode(new Uint8Array(buffer));
  } catch (error) {
    throw new ProtocolError(`The message is not msgpack: ${String(error)}`);
  }
  if (!isMap(message) || typeof message.type !== "string") {
    throw new ProtocolError("The message is not a map with a type.");
  }
  switch (message.type) {
    case "frame":
      return frameOf(message);
    case "hello":
    case "notice":
    case "error":
      return message as unknown as ServerMessage;
    default:
      return null;
  }
}

/** A frame whose array has every pixel, whichever way it was sent; or that there is one. */
function frameOf(message: Record<string, unknown>): FrameMessage | AnnouncementMessage {
  const announced = announcementOf(message);
  if (announced !== null) return announced;
  const axes = Array.isArray(message.axes) ? message.axes : [];
  const frame = { ...message, axes, array: decoded(message, ndArray(message.array)) } as unknown as FrameMessage;
  const { meta, array } = frame;
  const { region, decimation, width, height }: Partial<FrameMeta> = isMap(meta) ? meta : {};
  if (region === undefined || decimation === undefined || width === undefined || height === undefined) return frame;
  if (array.shape.length < 2 || (region[2] === width && region[3] === height && decimation === 1)) return frame;
  const shape = [...array.shape.slice(0, -2), height, width];
  return { ...frame, array: { ...array, shape, data: whole(array.data, array.shape, { region, decimation }, width, height) } };
}

function announcementOf({ meta, product }: Record<string, unknown>): AnnouncementMessage | null {
  const { region, decimation, width, height, frame }: Partial<FrameMeta> = isMap(meta) ? meta : {};
  const announces = region !== undefined && region.join() === ANNOUNCING.join() && decimation === 1 && width !== 1 && height !== 1;
  return announces && typeof product === "string" && frame !== undefined ? { type: "announcement", frame, product } : null;
}

/** The array that codes stand for; the array itself where it has none. */
function decoded(message: Record<string, unknown>, array: NdArray): NdArray {
  const { encoding, scale, offset, brightness } = message;
  if (encoding === undefined) return array;
  const { data, shape } = array;
  if (encoding === "u16" && data instanceof Uint16Array && typeof scale === "number" && typeof offset === "number") {
    return { dtype: "<f4", shape, data: decodeU16(data, scale, offset) };
  }
  if (encoding === "reflection16" && data instanceof Uint16Array && shape.length === 3) {
    const light = ndArray(brightness);
    if (light.data instanceof Float32Array && light.shape.join() === shape.slice(1).join()) {
      return { dtype: "<f4", shape: [shape[0] + 1, ...shape.slice(1)], data: decodeReflection16(data, light.data) };
    }
  }
  throw new ProtocolError(`This page cannot read a frame encoded as ${String(encoding)}.`);
}

/** What is asked for where nothing is looked at, so that frames and their figures come all the same: the smallest. */
export const LEAST_PRODUCTS: readonly string[] = ["flags"];

/** One product, as it is asked for; what is left out has its default. */
export interface Subscription {
  readonly product: string;
  readonly max_rate_hz: number | null;
  readonly encoding?: string;
  readonly region?: readonly number[];
  readonly decimation?: number;
}

/** The first message of a client, and every later change of its subscription: frames from the next one on. */
export function encodeSubscribe(
  subscriptions: readonly Subscription[],
  credits: number,
  token: string | null = null,
): Uint8Array<ArrayBuffer> {
  return encode({ type: "subscribe", v: 1, token, subscriptions, credits, start: null }) as Uint8Array<ArrayBuffer>;
}

/** Says that frame `frame` and all before it were taken. */
export function encodeAck(frame: number): Uint8Array<ArrayBuffer> {
  return encode({ type: "ack", frame }) as Uint8Array<ArrayBuffer>;
}

function isMap(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value) && !ArrayBuffer.isView(value);
}

function ndArray(value: unknown): NdArray {
  if (!isMap(value)) throw new ProtocolError("A frame came without an array.");
  const { dtype, shape, data } = value;
  if (typeof dtype !== "string" || !(dtype in ITEM_BYTES)) {
    throw new ProtocolError(`This page does not know arrays of ${String(dtype)}.`);
  }
  if (!Array.isArray(shape) || !shape.every((n) => Number.isInteger(n) && (n as number) >= 0)) {
    throw new ProtocolError("An array came without a shape.");
  }
  const bytes = ITEM_BYTES[dtype as Dtype] * (shape as number[]).reduce((a, b) => a * b, 1);
  if (!(data instanceof Uint8Array) || data.byteLength !== bytes) {
    throw new ProtocolError(`An array of shape (${shape.join(", ")}) came without its ${bytes} bytes.`);
  }
  return { dtype: dtype as Dtype, shape: shape as number[], data: numbers(dtype as Dtype, data) };
}

function numbers(dtype: Dtype, bytes: Uint8Array): Numbers {
  if (dtype === "|u1") return bytes;
  const align = dtype === "<f8" ? 8 : dtype === "<u2" ? 2 : 4;
  // The service pads its messages so that data is aligned; a proxy's or another server's need a copy.
  const { buffer, byteOffset, byteLength } = bytes.byteOffset % align === 0 ? bytes : bytes.slice();
  if (dtype === "<f8") return new Float64Array(buffer, byteOffset, byteLength / 8);
  if (dtype === "<u2") return new Uint16Array(buffer, byteOffset, byteLength / 2);
  return new Float32Array(buffer, byteOffset, byteLength / 4);
}
