import { expect, test } from "vitest";

import { Api } from "../../src/store/api";
import { Caller } from "../../src/store/caller";

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
