import { useStore } from "../../store/store";
import { ActionMenu } from "../../ui/ActionMenu";
import { THEMES, type ThemeChoice } from "../../ui/theme";
import { LAYOUTS } from "../layout";

/** What concerns the page and not the camera. */
export function PageMenu() {
  const store = useStore();
  const { choice } = store.theme;
  const { credentials } = store.api;
  const link = async (): Promise<void> => {
    try {
      await navigator.clipboard.writeText(window.location.href);
    } catch {
      // Refused, or not over https: the address is the same.
      store.status.unreadable.value = `The link is this page's address: ${window.location.href}`;
    }
  };
  return (
    <ActionMenu
      label="Page: layout, colours, help"
      groups={[
        {
          title: "Layout",
          actions: Object.entries(LAYOUTS).map(([text, layout]) => ({
            text,
            run: () => {
              store.layout.value = layout;
              store.alone.value = null;
            },
          })),
        },
        { title: "Colours", actions: THEMES.map((theme) => ({ text: THEME_NAMES[theme] + (theme === choice.value ? " ✓" : ""), run: () => (choice.value = theme) })) },
        {
          title: "Help",
          actions: [
            { text: "Keys (?)", run: () => (store.help.value = true) },
            { text: "Copy a link to what is shown", run: () => void link() },
          ],
        },
        {
          title: "Access",
          actions: [
            { text: "Control…", run: () => (store.asksForControl.value = true) },
            { text: "Token…", run: () => (store.asksForToken.value = true) },
            ...(credentials.token.value === null ? [] : [{ text: "Forget the token", run: () => { credentials.use(null); } }]),
          ],
        },
      ]} // prettier-ignore
    />
  );
}

const THEME_NAMES: Record<ThemeChoice, string> = { auto: "As the system", light: "Light", dark: "Dark" };
