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
        { text: "Save or remove a layout…", run: () => (store.dialog.value = "layout") },
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
        { text: "All commands (K)", run: () => (store.dialog.value = "palette") },
        { text: "Examples", run: () => (store.dialog.value = "examples") },
        { text: "Tour of one minute", run: () => (store.dialog.value = "tour") },
        { text: "Help and keys (?)", run: () => (store.dialog.value = "help") },
      ],
    },
    {
      title: "Share",
      actions: [
        { text: "Share this frame", run: () => void share(window, store) },
        { text: "Copy a link to what is shown", run: () => void copyLink(window, store) },
        ...store.light.files.value.map(({ text, run }) => ({ text: `Light: ${text}`, run })),
      ],
    },
    {
      title: "Access",
      actions: [
        { text: "Change the camera…", run: () => (store.dialog.value = "camera") },
        { text: "Take control…", run: () => (store.dialog.value = "control") },
        { text: "Token…", run: () => (store.dialog.value = "token") },
        ...(credentials.token.value === null ? [] : [{ text: "Forget the token", run: () => credentials.use(null) }]),
      ],
    },
  ];
}

const THEME_NAMES: Record<ThemeChoice, string> = { auto: "As the system", light: "Light", dark: "Dark" };
