import { signal } from "@preact/signals";
import type { ComponentType, FunctionComponent } from "preact";
import { useEffect } from "preact/hooks";

/** The view of a module, its one export, which is loaded when it is first shown: the first picture does not wait for it. */
export function later<P extends object = object>(load: () => Promise<Readonly<Record<string, ComponentType<P>>>>): FunctionComponent<P> {
  const loaded = signal<ComponentType<P> | null>(null);
  const Trouble = () => <p class="absent">This part of the page could not be loaded: load the page anew.</p>;
  return (properties) => {
    useEffect(() => {
      load().then(
        (module) => (loaded.value = Object.values(module)[0]),
        () => (loaded.value = Trouble),
      );
    }, []);
    return loaded.value && <loaded.value {...properties} />;
  };
}
