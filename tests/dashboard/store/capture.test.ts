import { expect, test } from "vitest";

import { type Api, RequestError } from "../../../client/dashboard/src/store/api";
import { captureOne } from "../../../client/dashboard/src/store/capture";
import { answering } from "../answering";

function camera(answers: (number | RequestError)[]): { api: Api; sent: string[] } {
  const sent: string[] = [];
  const api = answering(
    {
      "PUT /acquisition": ({ body }) => sent.push(body.running ? "start" : "stop"),
      "GET /frames/{frame}": ({ at }) => {
        sent.push(`wait after ${/after=(\d+)/.exec(at)?.[1]}`);
        const frame = answers.shift();
        return frame instanceof RequestError ? Promise.reject(frame) : { frame };
      },
    },
    { newestFrame: () => Promise.resolve(7) },
  );
  return { api, sent };
}

const early = new RequestError({ type: "/problems/no-frame-yet", title: "No frame yet" });
const lost = new RequestError({ type: "/problems/camera-lost", title: "Camera not connected" });

test("a single capture is a frame that begins after it was asked for; the camera stands then", async () => {
  const { api, sent } = camera([8]);
  expect(await captureOne(api, 0.1)).toBe(8);
  expect(sent).toEqual(["stop", "start", "wait after 7", "stop"]);
});

test("a capture that takes long is waited for, but not for ever", async () => {
  const { api, sent } = camera([early, early, 8]);
  expect(await captureOne(api, 12)).toBe(8);
  expect(sent.filter((each) => each.startsWith("wait"))).toHaveLength(3);
  await expect(captureOne(camera([early, early, early, early]).api, 0.1)).rejects.toThrow("No frame yet");
});

test("a camera that fails meanwhile is stopped nevertheless", async () => {
  const { api, sent } = camera([lost]);
  await expect(captureOne(api, 0.1)).rejects.toThrow(lost);
  expect(sent.at(-1)).toBe("stop");
});
