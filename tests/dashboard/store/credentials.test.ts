import { expect, test } from "vitest";

import { Api, RequestError } from "../../../client/dashboard/src/store/api";
import { Credentials } from "../../../client/dashboard/src/store/credentials";
import type { Shelf } from "../../../client/dashboard/src/store/settings";

class MemoryShelf implements Shelf {
  readonly items = new Map<string, string>();
  getItem(key: string): string | null {
    return this.items.get(key) ?? null;
  }
  setItem(key: string, value: string): void {
    this.items.set(key, value);
  }
}

test("a token is found again in the same tab, and forgotten for good", () => {
  const shelf = new MemoryShelf();
  new Credentials(shelf).use("  tc_secret\n");
  const again = new Credentials(shelf);
  expect(again.token.value).toBe("tc_secret");
  expect(again.headers(false)).toEqual({ Authorization: "Bearer tc_secret" });
  again.use(null);
  expect(new Credentials(shelf).token.value).toBeNull();
  expect([...shelf.items.values()].join("")).not.toContain("tc_secret");
});

test("where nothing is kept, a token holds as long as the page", () => {
  const refuse = (): never => {
    throw new Error("denied");
  };
  const credentials = new Credentials({ getItem: refuse, setItem: refuse });
  credentials.use("tc_secret");
  expect(credentials.token.value).toBe("tc_secret");
});

test("a token that is refused is said so, until another is shown", async () => {
  const problem = { type: "/problems/token-refused", title: "Invalid token", status: 401 };
  const sent: unknown[] = [];
  const api = new Api((_, init) => {
    sent.push(new Headers(init?.headers).get("Authorization"));
    return Promise.resolve(Response.json(problem, { status: 401 }));
  });
  api.credentials.use("wrong");
  const refusals: string[] = [];
  api.onRefusal = ({ title }) => refusals.push(title ?? "");
  await expect(api.ask("GET /camera")).rejects.toThrow(RequestError);
  expect(sent).toEqual(["Bearer wrong"]);
  expect(refusals).toEqual([problem.title]);
  expect(api.credentials.refused.value?.type).toBe(problem.type);
  api.credentials.use("right");
  expect(api.credentials.refused.value).toBeNull();
});
