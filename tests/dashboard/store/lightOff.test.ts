import { afterEach, beforeEach, expect, test, vi } from "vitest";

import { Api } from "../../../client/dashboard/src/store/api";
import { LightOff } from "../../../client/dashboard/src/store/lightOff";

/** Answers of a service, one for each request; the last for all that follow. */
let answers: (() => Promise<Response>)[];
let asked: { url: string; keepalive: boolean | undefined }[];
let seen: string[];
let lightOff: LightOff;

const off = () => Promise.resolve(Response.json({ running: false, state: "stopped" }));
const unreachable = () => Promise.reject(new TypeError("Failed to fetch"));
const refusal = (status: number) => () => Promise.resolve(Response.json({ status, detail: `No: ${status}.` }, { status }));

beforeEach(() => {
  vi.useFakeTimers();
  [answers, asked, seen] = [[off], [], []];
  const api = new Api((url, init) => {
    asked.push({ url: String(url), keepalive: init?.keepalive });
    return (answers.length > 1 ? answers.shift() : answers[0])?.() as Promise<Response>;
  });
  lightOff = new LightOff(api, (state) => seen.push(state));
});
afterEach(() => vi.useRealTimers());

test("a press is one request, which a page that is closed does not take back", async () => {
  lightOff.press();
  expect(lightOff.state.value).toEqual({ kind: "sent" });
  await vi.advanceTimersByTimeAsync(60_000);
  expect(asked).toEqual([{ url: "api/v1/acquisition/safe-off", keepalive: true }]);
  expect(seen).toEqual(["stopped"]);
  expect(lightOff.state.value).toBeNull();
});

test.each([
  ["is away", unreachable],
  ["is loaded", refusal(429)],
  ["has lost the camera", refusal(503)],
])("a service that %s is asked again until it has confirmed", async (_, answer) => {
  answers = [answer, answer, answer, off];
  lightOff.press();
  await vi.advanceTimersByTimeAsync(0);
  expect(lightOff.state.value?.kind).toBe("unconfirmed");
  await vi.advanceTimersByTimeAsync(2500);
  expect(lightOff.state.value?.kind).toBe("unconfirmed");
  expect(seen).toEqual([]);
  await vi.advanceTimersByTimeAsync(60_000);
  expect(asked).toHaveLength(4);
  expect(seen).toEqual(["stopped"]);
  expect(lightOff.state.value).toBeNull();
});

test.each([401, 403])("who may not, by %d, is told so once", async (status) => {
  answers = [refusal(status)];
  lightOff.press();
  await vi.advanceTimersByTimeAsync(60_000);
  expect(asked).toHaveLength(1);
  expect(lightOff.state.value).toEqual({ kind: "refused", reason: `No: ${status}.` });
});

test("after a start no request of an earlier press goes out", async () => {
  answers = [unreachable];
  lightOff.press();
  await vi.advanceTimersByTimeAsync(500);
  lightOff.withdraw();
  await vi.advanceTimersByTimeAsync(60_000);
  expect(asked).toHaveLength(1);
  expect(lightOff.state.value).toBeNull();
});

test("an answer that comes after the light was started anew changes nothing", async () => {
  let answer: (response: Response) => void = () => undefined;
  answers = [() => new Promise((resolve) => (answer = resolve))];
  lightOff.press();
  lightOff.withdraw();
  answer(await off());
  await vi.advanceTimersByTimeAsync(60_000);
  expect(seen).toEqual([]);
  expect(lightOff.state.value).toBeNull();
});
