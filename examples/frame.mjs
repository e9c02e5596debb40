// One frame with Node 18 or newer and nothing else:  node examples/frame.mjs http://127.0.0.1:8000
//
// fetch for the resources, and the .npy format for arrays, which takes ten lines to read.

const url = `${process.argv[2] ?? "http://127.0.0.1:8000"}/api/v1`;
const TYPES = { "<f4": Float32Array, "<f8": Float64Array, "<u2": Uint16Array, "|u1": Uint8Array };

/** Ask the daemon; a problem that it answers with (RFC 9457) becomes an error. */
async function ask(path, options) {
  const response = await fetch(`${url}/${path}`, options);
  if (!response.ok) {
    const problem = await response.json();
    const about = problem.field ? ` (${problem.field}: ${JSON.stringify(problem.value)})` : "";
    throw new Error(`${response.status} ${problem.title}: ${problem.detail ?? ""}${about}`);
  }
  return response;
}

const json = async (path, options) => (await ask(path, options)).json();

/** Read an array in NumPy's format: magic, version, length of a header, header, values. */
function readNpy(buffer) {
  const headerBytes = new DataView(buffer).getUint16(8, true);
  const header = new TextDecoder("latin1").decode(new Uint8Array(buffer, 10, headerBytes));
  const dtype = /'descr': '([^']+)'/.exec(header)[1];
  const shape = /'shape': \(([\d, ]*)\)/.exec(header)[1].match(/\d+/g).map(Number);
  return { shape, values: new TYPES[dtype](buffer.slice(10 + headerBytes)) };
}

const camera = await json("camera");
console.log(`${camera.capabilities.model}, ${camera.capabilities.width} x ${camera.capabilities.height} pixels`);

const settings = { base_frequency_hz: 23e6, harmonics: 3, zeroth: "estimated", exposure_s: 0.0005 };
const applied = await json("sequence", {
  method: "PUT",
  headers: { "content-type": "application/json" },
  body: JSON.stringify(settings),
});
console.log(`${applied.images} images a frame at ${applied.frame_rate_hz.toFixed(1)} Hz`);

const latest = await json("frames/latest?wait_s=10");
const range = readNpy(await (await ask("frames/latest/range.npy")).arrayBuffer());
const finite = Array.from(range.values.filter(Number.isFinite)).sort((a, b) => a - b);
console.log(
  `frame ${latest.frame} or newer: range ${range.shape.join(" x ")}, ${finite.length} pixels have one, ` +
    `${finite[0].toFixed(3)} to ${finite.at(-1).toFixed(3)} m, median ${finite[finite.length >> 1].toFixed(3)} m`,
);

const pixel = await json("frames/latest/pixel?x=80&y=60&bins=16");
console.log(`pixel (80, 60): ${Object.keys(pixel).join(", ")}`);

// a mistake is answered with what is wrong and what would be right
await ask("sequence/validate", {
  method: "POST",
  headers: { "content-type": "application/json" },
  body: JSON.stringify({ harmonics: 99 }),
}).catch((error) => console.log(`refused: ${error.message}`));
