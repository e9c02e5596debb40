import { computed, effect, type ReadonlySignal, type Signal, signal } from "@preact/signals";

import { oneOf, type Settings } from "./settings";

export const THEMES = ["auto", "light", "dark"] as const;
export type ThemeChoice = (typeof THEMES)[number];

/** Light or dark: as the system has it, unless the user chose. */
export class Theme {
  readonly choice: Signal<ThemeChoice>;
  readonly dark: ReadonlySignal<boolean>;

  constructor(settings: Settings, system: MediaQueryList | null) {
    this.choice = settings.of<ThemeChoice>({ key: "theme", initial: "auto", ...oneOf(THEMES) });
    const systemDark = signal(system?.matches ?? false);
    system?.addEventListener("change", ({ matches }) => (systemDark.value = matches));
    this.dark = computed(() => (this.choice.value === "auto" ? systemDark.value : this.choice.value === "dark"));
  }

  /** Shows itself on the page's root, where the style sheet looks for it. */
  show(root: HTMLElement): () => void {
    return effect(() => void (root.dataset.theme = this.dark.value ? "dark" : "light"));
  }

  next(): void {
    this.choice.value = THEMES[(THEMES.indexOf(this.choice.peek()) + 1) % THEMES.length];
  }
}
