import { linkTo } from "../../store/permalink";
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
    const whole = linkTo(window, store);
    try {
      await navigator.clipboard.writeText(whole);
      store.events.tell("The link was copied: it shows this layout, pixel, time and these colours.", "good");
    } catch {
      // Refused, or not over https: to be copied by hand.
      store.status.unreadable.value = `The link to what is shown: ${whole}`;
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
            { text: "Take control…", run: () => (store.asksForControl.value = true) },
            { text: "Token…", run: () => (store.asksForToken.value = true) },
            ...(credentials.token.value === null ? [] : [{ text: "Forget the token", run: () => { credentials.use(null); } }]),
          ],
        },
      ]} // prettier-ignore
    />
  );
}

const THEME_NAMES: Record<ThemeChoice, string> = { auto: "As the system", light: "Light", dark: "Dark" };
