import { expect, test } from "vitest";

import { Settings } from "../../../client/dashboard/src/store/settings";
import { Theme } from "../../../client/dashboard/src/store/theme";

function system(matches: boolean) {
  let listener: ((event: { matches: boolean }) => void) | null = null;
  const list = {
    matches,
    addEventListener: (_: string, each: typeof listener) => (listener = each),
  };
  return { list: list as unknown as MediaQueryList, change: (dark: boolean) => listener?.({ matches: dark }) };
}

test("the page is as dark as the system until the user chooses", () => {
  const { list, change } = system(true);
  const theme = new Theme(new Settings(null), list);
  const root = { dataset: {} as Record<string, string> } as unknown as HTMLElement;
  const end = theme.show(root);
  expect(root.dataset.theme).toBe("dark");
  change(false);
  expect(root.dataset.theme).toBe("light");
  theme.choice.value = "dark";
  expect(root.dataset.theme).toBe("dark");
  change(true);
  change(false);
  expect(root.dataset.theme).toBe("dark");
  end();
});
