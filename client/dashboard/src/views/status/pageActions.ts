import { LAYOUTS } from "../../store/layout";
import { copyLink, share } from "../../store/permalink";
import type { Store } from "../../store/store";
import { THEMES, type ThemeChoice } from "../../store/theme";
import type { ActionGroup } from "../../ui/ActionMenu";
import { chooseFile } from "../files/openFile";

/** What can be done that concerns the page and not the camera. */
export function pageActions(store: Store): ActionGroup[] {
  const { choice } = store.theme;
  const { credentials } = store.api;
  return [
    {
      title: "Layout",
      actions: [
        ...Object.entries({ ...LAYOUTS, ...store.layouts.named.value }).map(([text, layout]) => ({
          text,
          run: () => store.showLayout(layout),
        })),
        { text: "Save or remove a layout…", run: () => (store.asksForLayout.value = true) },
        ...(store.layouts.undoable.value ? [{ text: "Undo the last change (Z)", run: () => store.layouts.undo() }] : []),
      ],
    },
    {
      title: "Colours",
      actions: THEMES.map((theme) => ({
        text: THEME_NAMES[theme] + (theme === choice.value ? " ✓" : ""),
        run: () => (choice.value = theme),
      })),
    },
    { title: "Files", actions: [{ text: "Open a scene, recording or calibration…", run: () => chooseFile(store) }] },
    {
      title: "Stream",
      actions: [
        {
          text: `Ask for less where link or browser is too slow${store.adapts.value ? " ✓" : ""}`,
          run: () => (store.adapts.value = !store.adapts.peek()),
        },
      ],
    },
    {
      title: "Help",
      actions: [
        { text: "All commands (K)", run: () => (store.palette.value = true) },
        { text: "Examples", run: () => (store.examples.value = true) },
        { text: "Keys (?)", run: () => (store.help.value = true) },
        { text: "Share this frame", run: () => void share(window, store) },
        { text: "Copy a link to what is shown", run: () => void copyLink(window, store) },
      ],
    },
    {
      title: "Access",
      actions: [
        { text: "Change the camera…", run: () => (store.asksForCamera.value = true) },
        { text: "Take control…", run: () => (store.asksForControl.value = true) },
        { text: "Token…", run: () => (store.asksForToken.value = true) },
        ...(credentials.token.value === null ? [] : [{ text: "Forget the token", run: () => credentials.use(null) }]),
      ],
    },
  ];
}

const THEME_NAMES: Record<ThemeChoice, string> = { auto: "As the system", light: "Light", dark: "Dark" };
