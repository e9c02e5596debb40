/** Settings of the page: each is declared once, by its owner, with what it begins with, what it may be, its key in storage and its text in links. */
import { batch, effect, type Signal, signal } from "@preact/signals";

/** Where settings outlive the page; a browser may refuse it (private windows, policies). */
export interface Shelf {
  getItem(key: string): string | null;
  setItem(key: string, value: string): void;
}

const PREFIX = "transientcam.";

/** What a value may be. */
export interface Kind<T> {
  /** Whether it may come from storage. */
  accepts(value: unknown): value is T;
  /** As a link has it; "" is left out. */
  text(value: T): string;
  /** The value of a text; undefined for one that makes no sense. */
  parse(text: string): T | undefined;
}

export interface Setting<T> extends Partial<Kind<T>> {
  readonly initial: T;
  /** The key under which it is stored, with `accepts`. */
  readonly key?: string;
  /** Its name in a copied link, with `text` and `parse`. */
  readonly link?: string;
  /** The page's own address has it, too. */
  readonly followed?: boolean;
}

/** A part of what links say. */
export interface LinkPart {
  readonly followed?: boolean;
  /** "name=text", or "" for nothing. */
  write(): string;
  read(said: URLSearchParams): void;
}

export class Settings {
  readonly #values = new Map<object, unknown>();
  readonly #parts: LinkPart[] = [];
  /** What the last link said: also to settings of views that are shown later. */
  #said = new URLSearchParams();

  constructor(private readonly shelf: Shelf | null) {}

  /** The value of a setting, the same for all who ask. */
  of<T>(setting: Setting<T>): Signal<T> {
    const known = this.#values.get(setting) as Signal<T> | undefined;
    if (known !== undefined) return known;
    const value = signal(setting.initial);
    this.#values.set(setting, value);
    if (setting.key !== undefined) this.#remember(value, PREFIX + setting.key, setting);
    if (setting.link !== undefined) this.together(setting.link, [setting], setting);
    return value;
  }

  /**
   * Gives settings one place in links, their texts one after the other: all of them make sense, or none counts.
   *
   * `of` names what they belong to where there are several of a kind; only those that were changed are said.
   */
  together(
    link: string,
    settings: readonly Setting<unknown>[],
    { of = "", followed = false }: { readonly of?: string; readonly followed?: boolean } = {},
  ): void {
    const head = of === "" ? "" : `${of},`;
    const parts = settings.map((setting) => ({ setting, value: this.of(setting) }));
    this.add({
      followed,
      write: () => {
        if (of !== "" && parts.every(({ setting, value }) => value.value === setting.initial)) return "";
        const text = parts.map(({ setting, value }) => setting.text?.(value.value)).join();
        return text === "" ? "" : `${link}=${head}${text.replace(/,$/, "")}`;
      },
      read: (said) => {
        const text = said.getAll(link).find((each) => each.startsWith(head));
        if (text === undefined) return;
        const texts = text.slice(head.length).split(",");
        const last = texts.splice(parts.length - 1).join(); // which may have commas itself
        const read = parts.map(({ setting }, n) => setting.parse?.(texts[n] ?? last));
        if (!read.includes(undefined)) for (const [n, { value }] of parts.entries()) value.value = read[n];
      },
    });
  }

  #remember<T>(value: Signal<T>, key: string, { accepts }: Setting<T>): void {
    try {
      const stored: unknown = JSON.parse(this.shelf?.getItem(key) ?? "null");
      if (accepts?.(stored)) value.value = stored;
    } catch {
      // What cannot be read is not remembered.
    }
    effect(() => {
      const text = JSON.stringify(value.value);
      try {
        this.shelf?.setItem(key, text);
      } catch {
        // A full or refused store loses the setting, nothing else.
      }
    });
  }

  add(part: LinkPart): void {
    this.#parts.push(part);
    part.read(this.#said);
  }

  /** The part of an address behind #: of a copied link, or of the page's own address; "" for nothing in particular. */
  hash(whole: boolean): string {
    const said = this.#parts.filter(({ followed }) => whole || followed).flatMap((part) => part.write() || []);
    return said.length === 0 ? "" : `#${said.join("&")}`;
  }

  /** Takes over what an address says; parts that make no sense are as if they were not there. */
  follow(hash: string): void {
    this.#said = new URLSearchParams(hash.replace(/^#/, ""));
    batch(() => {
      for (const part of this.#parts) part.read(this.#said);
    });
  }
}

/** One of the given words. */
export function oneOf<T extends string>(words: readonly T[]): Kind<T> {
  return {
    accepts: (value): value is T => words.includes(value as T),
    text: (value) => value,
    parse: (text) => words.find((word) => word === text),
  };
}

/** A finite number between two ends. */
export function aNumber(least = -Infinity, most = Infinity): Kind<number> {
  const accepts = (value: unknown): value is number =>
    typeof value === "number" && Number.isFinite(value) && value >= least && value <= most;
  return { accepts, text: String, parse: (text) => (text !== "" && accepts(Number(text)) ? Number(text) : undefined) };
}

/** Yes or no, by two words of a link. */
export function aBoolean(yes = "on", no = "off"): Kind<boolean> {
  return {
    accepts: (value) => typeof value === "boolean",
    text: (value) => (value ? yes : no),
    parse: (text) => (text === yes ? true : text === no ? false : undefined),
  };
}

/** The browser's own shelf, or that of this tab, which is emptied when it is closed; null where it is refused. */
export function browserShelf(kind: "localStorage" | "sessionStorage"): Shelf | null {
  try {
    return window[kind];
  } catch {
    return null;
  }
}
