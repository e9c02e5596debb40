import type { Signal } from "@preact/signals";
import type { ComponentChildren, InputHTMLAttributes } from "preact";
import "./controls.css";

interface ChoiceProps<T extends string | number> {
  readonly label: string;
  /** What is chosen. */
  readonly chosen: Signal<T>;
  readonly of: readonly T[];
  readonly text: (value: T) => string;
}

/** One of several, as a drop-down. */
export function Choice<T extends string | number>({ label, chosen, of, text }: ChoiceProps<T>) {
  return (
    <label class="choice inline-row">
      <span class="quiet choice-label unseen">{label}</span>
      <select
        value={String(chosen.value)}
        onChange={(event) => {
          chosen.value = of.find((value) => String(value) === event.currentTarget.value) ?? chosen.peek();
        }}
      >
        {of.map((value) => (
          <option key={value} value={String(value)}>
            {text(value)}
          </option>
        ))}
      </select>
    </label>
  );
}

interface Tab<T extends string> {
  readonly value: T;
  readonly text: string;
  readonly hint?: string;
  /** Why it cannot be chosen. */
  readonly obstacle?: string | undefined;
}

interface TabsProps<T extends string> {
  readonly label: string;
  readonly value: T;
  readonly options: readonly Tab<T>[];
  readonly onChange: (value: T) => void;
}

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

interface CheckProps {
  readonly checked: boolean;
  readonly title?: string;
  readonly onChange: (checked: boolean) => void;
  readonly children: ComponentChildren;
}

/** A box that is ticked or not, with its words. */
export function Check({ checked, title, onChange, children }: CheckProps) {
  return (
    <label class="check" title={title}>
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

interface TextFieldProps {
  readonly label: string;
  /** What is typed. */
  readonly text: Signal<string>;
  readonly name: string;
  readonly type?: "text" | "password";
  readonly class?: string;
  readonly placeholder?: string;
  readonly maxLength?: number;
  readonly autocomplete?: string;
  readonly spellcheck?: boolean;
  readonly "aria-invalid"?: boolean;
}

/** Words as they are typed. */
export function TextField({ label, text, class: kind = "field", ...input }: TextFieldProps) {
  return (
    <label class={kind}>
      <span>{label}</span>
      <input
        {...({ type: "text", autocomplete: "off", ...input } as InputHTMLAttributes)}
        value={text.value}
        onInput={(event) => (text.value = event.currentTarget.value)}
      />
    </label>
  );
}

interface FormProps {
  readonly class: string;
  readonly onSubmit: () => void;
  readonly children: ComponentChildren;
}

/** Fields whose button, or the Enter key, does something in this page. */
export function Form({ class: kind, onSubmit, children }: FormProps) {
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

interface NumberFieldProps {
  readonly label: string;
  readonly unit: string;
  readonly name: string;
  readonly value: string;
  readonly onType: (text: string) => void;
  readonly placeholder?: string;
  readonly "aria-invalid"?: boolean;
  readonly "aria-describedby"?: string;
}

/** A number as it is typed, with its unit. */
export function NumberField({ label, unit, onType, ...input }: NumberFieldProps) {
  return (
    <label class="field">
      <span>{label}</span>
      <span class="field-input">
        <input type="text" inputMode="decimal" autocomplete="off" {...input} onInput={(event) => onType(event.currentTarget.value)} />
        <span class="quiet">{unit}</span>
      </span>
    </label>
  );
}
