import { expect, test, vi } from "vitest";

import { Api } from "../../../client/dashboard/src/store/api";
import { Caller } from "../../../client/dashboard/src/store/caller";

const answering = (answer: () => Response): Caller => new Caller(new Api(() => Promise.resolve(answer())));
const known = (role: string): Response => Response.json({ caller: { name: "bench-2", role } });

test.each([
  { role: "viewer", obstacle: "The token bench-2 is a viewer's" },
  { role: "operator", obstacle: null },
  { role: "admin", obstacle: null },
])("to a $role the obstacle is $obstacle", async ({ role, obstacle }) => {
  const caller = answering(() => known(role));
  expect(caller.obstacle.value).toBeNull();
  await caller.look();
  expect(caller.document.value).toEqual({ name: "bench-2", role });
  expect(caller.obstacle.value).toBe(obstacle);
});

test("a caller that is refused from now on is forgotten", async () => {
  let refused = false;
  const caller = answering(() =>
    refused ? Response.json({ type: "/problems/token-refused", status: 401 }, { status: 401 }) : known("viewer"),
  );
  await caller.look();
  refused = true;
  await caller.look();
  expect(caller.document.value).toBeNull();
  expect(caller.obstacle.value).toBeNull();
});

test("a service that prepares its kernels is asked until they are ready", async () => {
  vi.useFakeTimers();
  let left_s = 3;
  const caller = answering(() => Response.json({ caller: {}, kernels: left_s > 0 ? { preparing: ["returns"], left_s: left_s-- } : null }));
  await caller.look();
  expect(caller.kernels.value).toEqual({ preparing: ["returns"], left_s: 3 });
  await vi.advanceTimersByTimeAsync(60_000);
  expect(caller.kernels.value).toBeNull();
  expect(vi.getTimerCount()).toBe(0);
  vi.useRealTimers();
});
