import type { Signal } from "@preact/signals";
import type { ButtonHTMLAttributes, ComponentChildren, InputHTMLAttributes, SelectHTMLAttributes } from "preact";
import { COLOUR_MAPS, type ColourMapName } from "../scales/colourMaps";
import { TONES, type ToneKind } from "../scales/tone";
import type { Task } from "./useTask";
import "./controls.css";

export interface ButtonProps extends Omit<ButtonHTMLAttributes, "disabled" | "title"> {
  readonly title?: string | undefined;
  readonly disabled?: boolean;
  /** What it waits for while that is busy. */
  readonly task?: Task;
}

/** A button that does something in the page; of a form that is sent, its type says so. */
export function Button({ task, disabled = false, ...button }: ButtonProps) {
  return <button type="button" {...button} disabled={disabled || (task !== undefined && task.busy.value !== null)} />;
}

/** A small button that takes something away. */
export function Remove({ what, onClick }: { what: string; onClick: () => void }) {
  return (
    <Button class="remove" aria-label={what} title={what} onClick={onClick}>
      ✕
    </Button>
  );
}

interface ChoiceProps<T extends string | number> {
  readonly label: string;
  /** What is chosen. */
  readonly chosen: Signal<T>;
  readonly of: readonly T[];
  readonly text: (value: T) => string;
  /** What stands in it says what it is. */
  readonly bare?: boolean;
}

/** One of several, as a drop-down. */
export function Choice<T extends string | number>({ label, chosen, of, text, bare = false }: ChoiceProps<T>) {
  return (
    <label class="choice inline-row apart">
      <span class={bare ? "unseen" : "quiet"}>{label}</span>
      <Select value={chosen.value} of={of} text={text} onChoose={(value) => (chosen.value = value)} />
    </label>
  );
}

interface SelectProps<T extends string | number> extends Omit<SelectHTMLAttributes, "value" | "onChange"> {
  /** What is chosen. */
  readonly value: T;
  readonly of: readonly T[];
  readonly text: (value: T) => string;
  readonly onChoose: (value: T) => void;
}

/** A drop-down alone. */
export function Select<T extends string | number>({ of, text, onChoose, value: chosen, ...select }: SelectProps<T>) {
  return (
    <select
      {...(select as SelectHTMLAttributes)}
      value={String(chosen)}
      onChange={(event) => onChoose(of.find((value) => String(value) === event.currentTarget.value) ?? chosen)}
    >
      {of.map((value) => (
        <option key={value} value={String(value)}>
          {text(value)}
        </option>
      ))}
    </select>
  );
}

interface Tab<T extends string> {
  readonly value: T;
  readonly text: string;
  readonly hint?: string;
  /** Why it cannot be chosen. */
  readonly obstacle?: string | undefined;
}

type TabsProps<T extends string> = Readonly<{ label: string; value: T; options: readonly Tab<T>[]; onChange: (value: T) => void }>;

/** One of several, all in sight. Arrow keys move between them, as in any tab list. */
export function Tabs<T extends string>({ label, value, options, onChange }: TabsProps<T>) {
  const onKeyDown = (event: KeyboardEvent): void => {
    const step = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    if (step === 0) return;
    event.preventDefault();
    event.stopPropagation();
    const open = options.filter(({ obstacle }) => obstacle === undefined);
    const at = open.findIndex((option) => option.value === value);
    const next = open[(at + step + open.length) % open.length];
    onChange(next.value);
    const tabs = (event.currentTarget as HTMLElement).querySelectorAll<HTMLElement>("[role=tab]");
    tabs[options.indexOf(next)].focus();
  };
  return (
    <div class="tabs" role="tablist" aria-label={label} onKeyDown={onKeyDown}>
      {options.map((option) => (
        <button
          key={option.value}
          type="button"
          role="tab"
          aria-selected={option.value === value}
          tabIndex={option.value === value ? 0 : -1}
          title={option.obstacle ?? option.hint}
          aria-disabled={option.obstacle !== undefined}
          onClick={() => {
            if (option.obstacle === undefined) onChange(option.value);
          }}
        >
          {option.text}
        </button>
      ))}
    </div>
  );
}

type CheckProps = Readonly<{ checked: boolean; title?: string; onChange: (checked: boolean) => void; children: ComponentChildren }>;

/** A box that is ticked or not, with its words. */
export function Check({ checked, title, onChange, children }: CheckProps) {
  return (
    <label class="check inline-row nowrap" title={title}>
      <input type="checkbox" checked={checked} onChange={(event) => onChange(event.currentTarget.checked)} />
      <span>{children}</span>
    </label>
  );
}

/** On or off. */
export function Toggle({ on, title, children }: { on: Signal<boolean>; title: string; children: ComponentChildren }) {
  return (
    <button type="button" class="toggle" aria-pressed={on.value} title={title} onClick={() => (on.value = !on.peek())}>
      {children}
    </button>
  );
}

/** What is typed, and what else an input has. */
interface TypedProps extends Omit<InputHTMLAttributes, "value" | "onInput"> {
  readonly text: { value: string };
}

/** An input alone. */
export function Typed({ text, ...input }: TypedProps) {
  return (
    <input
      type="text"
      autocomplete="off"
      {...(input as InputHTMLAttributes)}
      value={text.value}
      onInput={(event) => (text.value = event.currentTarget.value)}
    />
  );
}

/** What is typed and kept elsewhere than in a signal. */
export function keptAs(value: string, onType: (text: string) => void): TypedProps["text"] {
  return {
    get value() {
      return value;
    },
    set value(text) {
      onType(text);
    },
  };
}

type FieldProps = TypedProps & Readonly<{ label: string }>;

/** Words as they are typed. */
export function TextField({ label, class: kind = "field", ...input }: FieldProps) {
  return (
    <label class={kind}>
      <span class="small quiet">{label}</span>
      <Typed {...input} />
    </label>
  );
}

/** A number as it is typed, with its unit. */
export function NumberField({ label, unit, ...input }: FieldProps & { readonly unit: string }) {
  return (
    <label class="field">
      <span class="small quiet">{label}</span>
      <span class="field-input row">
        <Typed inputMode="decimal" {...input} />
        <span class="quiet">{unit}</span>
      </span>
    </label>
  );
}

/** Fields whose button, or the Enter key, does something in this page. */
export function Form({ class: kind, onSubmit, children }: { class: string; onSubmit: () => void; children: ComponentChildren }) {
  return (
    <form
      class={kind}
      onSubmit={(event) => {
        event.preventDefault();
        onSubmit();
      }}
    >
      {children}
    </form>
  );
}

/** Which colours a picture has, by the names of the colour maps. */
export function ColourChoice({ colours }: { colours: Signal<ColourMapName> }) {
  return <Choice label="Colours" chosen={colours} of={COLOUR_MAPS} text={String} />;
}

const TONE_NAMES: Readonly<Record<ToneKind, string>> = { linear: "linear", root: "square root", logarithmic: "logarithmic" };

/** How the brightness of a picture grows with the density. */
export function ToneChoice({ tone }: { tone: Signal<ToneKind> }) {
  return <Choice label="Tone" chosen={tone} of={TONES} text={(kind) => TONE_NAMES[kind]} />;
}
