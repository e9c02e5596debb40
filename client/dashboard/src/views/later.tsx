import { signal } from "@preact/signals";
import type { ComponentType, FunctionComponent } from "preact";
import { useEffect } from "preact/hooks";

/** The view of a module, its one export, which is loaded when it is first shown: the first picture does not wait for it. */
export function later(load: () => Promise<Readonly<Record<string, ComponentType>>>): FunctionComponent {
  const loaded = signal<ComponentType | null>(null);
  const Trouble = () => <p class="absent">This part of the page could not be loaded: load the page anew.</p>;
  return () => {
    useEffect(() => {
      load().then(
        (module) => (loaded.value = Object.values(module)[0]),
        () => (loaded.value = Trouble),
      );
    }, []);
    return loaded.value && <loaded.value />;
  };
}
