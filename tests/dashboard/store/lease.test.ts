import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";

import { Api, type RequestError } from "../../../client/dashboard/src/store/api";
import { Lease } from "../../../client/dashboard/src/store/lease";

/** A service with one lease, as the real one keeps it. */
class Desk {
  now_s = 1000;
  held: { holder: string; id: string; expires_s: number } | null = null;
  readonly asked: string[] = [];
  reachable = true;
  #count = 0;
  readonly api = new Api((url, init) => Promise.resolve(this.#answer(init ?? {}, String(url))));
  readonly lease = new Lease(this.api, () => this.now_s);

  grant(holder: string, duration_s: number): void {
    this.held = { holder, id: `lease ${++this.#count}`, expires_s: this.now_s + duration_s };
  }

  async passes(span_s: number): Promise<void> {
    for (let left_s = span_s; left_s > 0; left_s -= 0.5) {
      this.now_s += 0.5;
      await vi.advanceTimersByTimeAsync(500);
    }
  }

  #answer({ method = "GET", headers, body }: RequestInit, url: string): Response {
    this.asked.push(`${method} ${url}`);
    if (!this.reachable) throw new TypeError("Failed to fetch");
    if (this.held !== null && this.held.expires_s <= this.now_s) this.held = null;
    const shown = (headers as Record<string, string>)["Transientcam-Lease"];
    const ours = this.held !== null && shown === this.held.id;
    if (method === "POST") {
      const wanted = JSON.parse(body as string) as { holder: string; duration_s: number; takeover: boolean };
      if (this.held !== null && !wanted.takeover) return this.#refusal("lease-held", `${this.held.holder} controls the camera.`);
      this.grant(wanted.holder, wanted.duration_s);
    } else if (method !== "GET") {
      if (!ours) return this.#refusal("lease-lost", "This lease is over.");
      if (method === "DELETE") this.held = null;
      else if (this.held !== null) this.held.expires_s = this.now_s + 90;
    }
    const { held } = this;
    return Response.json(
      held === null
        ? { held: false, holder: null, expires_in_s: null }
        : {
            held: true,
            holder: held.holder,
            expires_in_s: held.expires_s - this.now_s,
            ...(method === "GET" ? {} : { lease_id: held.id }),
          },
    );
  }

  #refusal(kind: string, detail: string): Response {
    return Response.json({ type: `/problems/${kind}`, status: 409, detail }, { status: 409 });
  }
}

let desk: Desk;
beforeEach(() => {
  vi.useFakeTimers();
  desk = new Desk();
});
afterEach(() => vi.useRealTimers());

describe("the lease", () => {
  test("is taken, shown with every change, and given back", async () => {
    await desk.lease.take("bench 2", false);
    expect(desk.lease.control.value).toMatchObject({ kind: "us", holder: "bench 2" });
    expect(desk.api.credentials.headers(true)).toEqual({ "Transientcam-Lease": desk.held?.id });
    expect(desk.api.credentials.headers(false)).toEqual({});
    await desk.lease.release();
    expect(desk.lease.control.value).toEqual({ kind: "free" });
    expect(desk.api.credentials.headers(true)).toEqual({});
  });

  test("is renewed for as long as the page stands", async () => {
    await desk.lease.take("bench 2", false);
    await desk.passes(600);
    expect(desk.held?.holder).toBe("bench 2");
    expect(desk.lease.control.value.kind).toBe("us");
    expect(desk.lease.lost.value).toBeNull();
  });

  test("outlives a service that cannot be reached for a while", async () => {
    await desk.lease.take("bench 2", false);
    desk.reachable = false;
    await desk.passes(45);
    desk.reachable = true;
    await desk.passes(30);
    expect(desk.lease.control.value.kind).toBe("us");
  });

  test("of another client is an obstacle, until it is over, which is noticed", async () => {
    desk.grant("the night shift", 12);
    await desk.lease.look();
    expect(desk.lease.obstacle.value).toBe("the night shift controls the camera");
    await desk.passes(14);
    expect(desk.lease.control.value).toEqual({ kind: "free" });
    expect(desk.lease.obstacle.value).toBeNull();
  });

  test("of another client is refused, or taken over", async () => {
    desk.grant("the night shift", 30);
    const refusal = await desk.lease.take("bench 2", false).catch((error: unknown) => error);
    expect((refusal as RequestError).kind).toBe("lease-held");
    await desk.lease.take("bench 2", true);
    expect(desk.lease.control.value).toMatchObject({ kind: "us", holder: "bench 2" });
  });

  test("that another client takes over is lost, which is said with the name", async () => {
    await desk.lease.take("bench 2", false);
    desk.grant("the night shift", 30);
    await desk.lease.look();
    expect(desk.lease.control.value).toMatchObject({ kind: "other", holder: "the night shift" });
    expect(desk.lease.lost.value).toBe("the night shift has taken over control.");
    expect(desk.api.credentials.leaseId.value).toBeNull();
  });

  test("that was taken over and given back again is lost no more", async () => {
    await desk.lease.take("bench 2", false);
    desk.grant("the night shift", 30);
    await desk.lease.look();
    desk.held = null;
    await desk.lease.look();
    expect(desk.lease.control.value).toEqual({ kind: "free" });
    expect(desk.lease.lost.value).toBeNull();
  });

  test("that a change was refused for is looked at anew", async () => {
    await desk.lease.take("bench 2", false);
    desk.held = null;
    desk.lease.refused("lease-lost");
    await vi.waitFor(() => expect(desk.lease.control.value).toEqual({ kind: "free" }));
    expect(desk.lease.lost.value).toBe("This page's control has lapsed.");
  });

  test("is given back by a page that is closed, and nothing is sent by one that has none", async () => {
    desk.lease.abandon();
    expect(desk.asked).toEqual([]);
    await desk.lease.take("bench 2", false);
    desk.lease.abandon();
    expect(desk.held).toBeNull();
  });
});
