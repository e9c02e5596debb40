import { beforeEach, describe, expect, test } from "vitest";

import { Announced, type Announcement } from "../../../client/dashboard/src/stream/announced";

/** A service whose answers come on command, one for each request in turn. */
class Service {
  readonly requested: string[] = [];
  readonly taken: number[] = [];
  readonly missed: string[] = [];
  #answers: { resolve: (body: ArrayBuffer) => void; reject: (error: Error) => void }[] = [];
  readonly announced = new Announced(
    (announcement) => {
      this.requested.push(nameOf(announcement));
      return new Promise((resolve, reject) => this.#answers.push({ resolve, reject }));
    },
    (body) => this.taken.push(body.byteLength),
    (announcement) => this.missed.push(nameOf(announcement)),
  );

  announces(frame: number, ...products: string[]): void {
    for (const product of products) this.announced.add({ frame, product }, PRODUCTS);
  }

  async answers(bytes: number): Promise<void> {
    this.#answers.shift()?.resolve(new ArrayBuffer(bytes));
    await settled();
  }

  async refuses(): Promise<void> {
    this.#answers.shift()?.reject(new Error("gone"));
    await settled();
  }
}

const PRODUCTS = 2;
const nameOf = ({ frame, product }: Announcement): string => `${frame} ${product}`;
const settled = async (): Promise<void> => {
  for (let turn = 0; turn < 8; turn++) await Promise.resolve();
};

let service: Service;
beforeEach(() => (service = new Service()));

describe("products that are announced", () => {
  test("are requested one after another", async () => {
    service.announces(1, "range", "light");
    expect(service.requested).toEqual(["1 range"]);
    await service.answers(7);
    expect(service.requested).toEqual(["1 range", "1 light"]);
    await service.answers(8);
    expect(service.taken).toEqual([7, 8]);
    service.announces(2, "range");
    expect(service.requested.at(-1)).toBe("2 range");
  });

  test("of a frame that was begun come first, then those of the newest", async () => {
    service.announces(1, "range");
    service.announces(2, "range", "light");
    service.announces(3, "range", "light");
    service.announces(1, "light");
    for (let answer = 0; answer < 4; answer++) await service.answers(1);
    expect(service.requested).toEqual(["1 range", "1 light", "3 range", "3 light"]);
  });

  test("that cannot be had are reported, and the next is requested", async () => {
    service.announces(1, "range", "light");
    await service.refuses();
    expect(service.missed).toEqual(["1 range"]);
    expect(service.requested.at(-1)).toBe("1 light");
  });

  test("are not wanted any more once something else is asked for", async () => {
    service.announces(1, "range", "light");
    service.announced.clear();
    service.announces(2, "range");
    await service.answers(5);
    expect(service.taken).toEqual([]);
    await service.answers(6);
    expect(service.taken).toEqual([6]);
    expect(service.requested).toEqual(["1 range", "2 range"]);
  });
});

describe("a frame is done", () => {
  test("once all of its products are announced and came", async () => {
    expect(service.announced.done).toBe(Infinity);
    service.announces(4, "range");
    await service.answers(1);
    expect(service.announced.done).toBe(3);
    service.announces(4, "light");
    expect(service.announced.done).toBe(3);
    await service.answers(1);
    expect(service.announced.done).toBe(Infinity);
  });

  test("where the next is announced before one of its products, which the service could not compute", async () => {
    service.announces(4, "range");
    await service.answers(1);
    service.announces(5, "range");
    expect(service.announced.done).toBe(4);
  });

  test("where something else is asked for", () => {
    service.announces(4, "range");
    service.announced.clear();
    expect(service.announced.done).toBe(Infinity);
  });
});
