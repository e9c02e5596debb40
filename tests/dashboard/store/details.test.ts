import { signal } from "@preact/signals";
import { expect, test, vi } from "vitest";

import { type Api, LIVE, RequestError } from "../../../client/dashboard/src/store/api";
import { Details } from "../../../client/dashboard/src/store/details";
import type { Frame } from "../../../client/dashboard/src/store/frames";
import type { Pixel } from "../../../client/dashboard/src/store/pixel";
import { answering } from "../answering";

const frame = (number: number, sequence_id = 1): Frame =>
  ({ origin: LIVE, meta: { frame: number, sequence_id, width: 10, height: 10 } }) as Frame;
const settled = (): Promise<void> => new Promise((done) => setTimeout(done));

/** The pixel that an address asks about. */
function pixelIn(at: string): Pixel {
  const query = new URLSearchParams(at.slice(at.indexOf("?")));
  return { x: Number(query.get("x")), y: Number(query.get("y")) };
}

function watched() {
  const asked: string[] = [];
  let now_s = 0;
  let number = 1;
  const api = answering({
    "GET /frames/{frame}/pixel": ({ at }) => {
      const { x, y } = pixelIn(at);
      asked.push(`${x},${y}`);
      return { x, y, meta: { frame: number, sequence_id: 1 } };
    },
  });
  const details = new Details(api, () => now_s);
  const pixel = signal<Pixel | null>(null);
  const newest = signal<Frame | null>(frame(1));
  const end = details.follow(pixel, newest);
  const arrive = (after_s: number, sequence_id?: number): void => {
    now_s += after_s;
    number += 1;
    newest.value = frame(number, sequence_id);
  };
  return { asked, details, pixel, arrive, end };
}

test("nothing is asked before a pixel is chosen, nor about one outside of the picture", async () => {
  const { asked, pixel, end } = watched();
  await settled();
  pixel.value = { x: 10, y: 0 };
  await settled();
  expect(asked).toEqual([]);
  end();
});

test("a pixel is asked about at once, and again with later frames but not with each", async () => {
  const { asked, details, pixel, arrive, end } = watched();
  pixel.value = { x: 3, y: 4 };
  await settled();
  expect(details.document.value?.x).toBe(3);
  for (const after_s of [0.1, 0.1, 0.4]) {
    arrive(after_s);
    await settled();
  }
  expect(asked).toEqual(["3,4", "3,4"]);
  end();
});

test("what is known of one pixel is not shown as another's", async () => {
  const { asked, details, pixel, end } = watched();
  pixel.value = { x: 3, y: 4 };
  await settled();
  pixel.value = { x: 5, y: 5 };
  expect(details.document.value).toBeNull();
  pixel.value = { x: 6, y: 6 }; // while the question about 5, 5 is on its way
  await vi.waitFor(() => expect(details.document.value?.x).toBe(6));
  expect(asked).toEqual(["3,4", "5,5", "6,6"]);
  end();
});

test("what is known goes with the frame that it is of, and is forgotten with its sequence", async () => {
  const { details, pixel, arrive, end } = watched();
  pixel.value = { x: 3, y: 4 };
  await settled();
  expect(details.frame.value?.meta.frame).toBe(1);
  arrive(0.1); // too soon to ask: it stays beside what was found in it
  expect([details.document.value?.meta.frame, details.frame.value?.meta.frame]).toEqual([1, 1]);
  arrive(0.1, 2);
  expect([details.document.value, details.frame.value]).toEqual([null, null]);
  end();
});

/** A service whose newest frame is 90, and which keeps no frame before 80. */
function keeping(): { api: Api; asked: string[] } {
  const asked: string[] = [];
  const pixel = (at: string): unknown => {
    const address = at.slice(0, at.indexOf("/pixel"));
    asked.push(address);
    const number = address === LIVE ? 90 : Number(address.split("/").pop());
    if (number < 80) throw new RequestError({ type: "/problems/frame-gone" });
    return { ...pixelIn(at), meta: { frame: number, sequence_id: 1 } };
  };
  return { api: answering({ "GET /frames/{frame}/pixel": ({ at }) => pixel(at) }), asked };
}

test.each([
  { held: 85, answered: 85, addresses: ["/frames/85"] },
  { held: 70, answered: 90, addresses: ["/frames/70", LIVE] },
])("a pixel of frame $held, held for a while, is answered of frame $answered", async ({ held, answered, addresses }) => {
  const { api, asked } = keeping();
  const details = new Details(api);
  const end = details.follow(signal<Pixel | null>({ x: 3, y: 4 }), signal<Frame | null>(frame(held)));
  await vi.waitFor(() => expect(details.document.value?.meta.frame).toBe(answered));
  expect(asked).toEqual(addresses);
  end();
});
