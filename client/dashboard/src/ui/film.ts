/** Films: pictures of a canvas, one after the other, as a file. */

export type FilmKind = "webm" | "gif";

/** Whether the user cancelled a film, and how far it is. */
export interface Progress {
  readonly cancelled: boolean;
  /** Takes the share that is done, 0 to 1. */
  readonly report: (share: number) => void;
}

/** A film in the making: `add` takes what the canvas shows now, for `duration_s`. */
interface Recorder {
  add(duration_s: number): Promise<void>;
  finish(): Promise<Blob>;
}

/** Takes a film of a canvas. Raises Error where the browser cannot make that kind. */
export async function recorderOf(canvas: HTMLCanvasElement, kind: FilmKind): Promise<Recorder> {
  return kind === "gif" ? await gifRecorder(canvas) : webmRecorder(canvas);
}

/** Colours of each picture of a GIF: the format has no more than 256. */
const GIF_COLOURS = 128;

async function gifRecorder(canvas: HTMLCanvasElement): Promise<Recorder> {
  const { GIFEncoder, quantize, applyPalette } = await import("gifenc");
  const encoder = GIFEncoder();
  const context = canvas.getContext("2d", { willReadFrequently: true }) as CanvasRenderingContext2D;
  return {
    add: async (duration_s) => {
      const { data, width, height } = context.getImageData(0, 0, canvas.width, canvas.height);
      const palette = quantize(data, GIF_COLOURS);
      encoder.writeFrame(applyPalette(data, palette), width, height, { palette, delay: 1000 * duration_s });
      await pause(0); // so that the page goes on
    },
    finish: () => {
      encoder.finish();
      return Promise.resolve(new Blob([encoder.bytes()], { type: "image/gif" }));
    },
  };
}

const WEBM = ["video/webm;codecs=vp9", "video/webm;codecs=vp8"];
const WEBM_BITS_PER_S = 8e6;

/** The browser's own recorder, which stamps each picture with the time at which it comes: a film takes as long as it lasts. */
function webmRecorder(canvas: HTMLCanvasElement): Recorder {
  const mimeType = typeof MediaRecorder === "undefined" ? undefined : WEBM.find((each) => MediaRecorder.isTypeSupported(each));
  if (mimeType === undefined) throw new Error("This browser records no WebM; a GIF it can make.");
  const stream = canvas.captureStream(0);
  const [track] = stream.getVideoTracks() as CanvasCaptureMediaStreamTrack[];
  const recorder = new MediaRecorder(stream, { mimeType, videoBitsPerSecond: WEBM_BITS_PER_S });
  const parts: Blob[] = [];
  recorder.ondataavailable = ({ data }) => parts.push(data);
  const stopped = new Promise<void>((done) => (recorder.onstop = () => done()));
  recorder.start();
  return {
    add: async (duration_s) => {
      track.requestFrame();
      await pause(duration_s);
    },
    finish: async () => {
      recorder.stop();
      await stopped;
      track.stop();
      return new Blob(parts, { type: "video/webm" });
    },
  };
}

function pause(duration_s: number): Promise<void> {
  return new Promise((done) => setTimeout(done, 1000 * duration_s));
}
