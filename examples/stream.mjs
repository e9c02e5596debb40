// Frames as they are captured, over the WebSocket of docs/stream.md:
//
//   npm install @msgpack/msgpack
//   node examples/stream.mjs http://127.0.0.1:8000 range 10
//
// Node 22 has WebSocket; Node 20 has it behind --experimental-websocket. Runs in a browser, too.
import { decode, encode } from "@msgpack/msgpack";

const [address = "http://127.0.0.1:8000", product = "range", count = "10"] = process.argv.slice(2);
const TYPES = { "<f4": Float32Array, "<f8": Float64Array, "<u2": Uint16Array, "|u1": Uint8Array };

const socket = new WebSocket(`${address.replace(/^http/, "ws")}/api/v1/stream`, "transientcam.v1.msgpack");
socket.binaryType = "arraybuffer";
let received = 0;

/** Return the values of an array; they begin at a multiple of 8 bytes of the message. */
function valuesOf(array) {
  const { buffer, byteOffset, byteLength } = array.data;
  const Type = TYPES[array.dtype];
  return new Type(buffer, byteOffset, byteLength / Type.BYTES_PER_ELEMENT);
}

const send = (message) => socket.send(encode(message));

socket.onopen = () =>
  send({ type: "subscribe", v: 1, token: process.env.TRANSIENTCAM_TOKEN ?? null, subscriptions: [{ product }], credits: 2, start: null });

socket.onmessage = ({ data }) => {
  const message = decode(data);
  switch (message.type) {
    case "hello": {
      const [channel] = message.channels;
      console.log(`${message.server.name}: ${channel.product} of ${channel.shape.join(" x ")} in ${channel.unit}`);
      break;
    }
    case "frame": {
      const values = valuesOf(message.array);
      const finite = values.filter(Number.isFinite);
      const mean = finite.reduce((sum, value) => sum + value, 0) / finite.length;
      const age_ms = Date.now() - message.meta.host_time_s * 1e3;
      console.log(`frame ${message.meta.frame}: mean ${mean.toFixed(4)} ${message.unit}, ${age_ms.toFixed(0)} ms old`);
      // a client that acknowledges gets the newest frame next, however slow it is
      send({ type: "ack", frame: message.meta.frame });
      if (++received === Number(count)) socket.close(1000);
      break;
    }
    case "notice":
      console.log(`notice: ${message.kind}`);
      break;
    case "error":
      console.error(`${message.problem.title}: ${message.problem.detail}`);
      process.exitCode = 1;
  }
};

socket.onclose = ({ code, reason }) => {
  console.log(`closed (${code}) ${reason}`);
  if (code !== 1000) process.exitCode = 1;
};
socket.onerror = () => {
  console.error(`no camera answers at ${address}`);
  process.exitCode = 1;
};
