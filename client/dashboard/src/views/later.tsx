import { signal } from "@preact/signals";
import type { ComponentType } from "preact";
import { useEffect } from "preact/hooks";

/** A view that is loaded when it is first shown, so that the first picture does not wait for it. */
export function later(load: () => Promise<ComponentType>): ComponentType {
  const loaded = signal<ComponentType | null>(null);
  const Trouble = () => <p class="absent">This part of the page could not be loaded: load the page anew.</p>;
  return () => {
    useEffect(() => {
      load().then(
        (view) => (loaded.value = view),
        () => (loaded.value = Trouble),
      );
    }, []);
    const View = loaded.value;
    return View === null ? null : <View />;
  };
}
