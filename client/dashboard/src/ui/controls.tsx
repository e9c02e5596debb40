import type { ComponentChildren } from "preact";
import "./controls.css";

interface ChoiceProps<T extends string | number> {
  readonly label: string;
  readonly value: T;
  readonly options: readonly { readonly value: T; readonly text: string }[];
  readonly onChange: (value: T) => void;
}

/** One of several, as a drop-down. */
export function Choice<T extends string | number>({ label, value, options, onChange }: ChoiceProps<T>) {
  return (
    <label class="choice">
      <span class="quiet choice-label unseen">{label}</span>
      <select
        value={String(value)}
        onChange={(event) => {
          const chosen = options.find((option) => String(option.value) === event.currentTarget.value);
          if (chosen !== undefined) onChange(chosen.value);
        }}
      >
        {options.map((option) => (
          <option key={option.value} value={String(option.value)}>
            {option.text}
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

interface ToggleProps {
  readonly pressed: boolean;
  readonly title: string;
  readonly onToggle: () => void;
  readonly children: ComponentChildren;
}

/** On or off. */
export function Toggle({ pressed, title, onToggle, children }: ToggleProps) {
  return (
    <button type="button" class="toggle" aria-pressed={pressed} title={title} onClick={onToggle}>
      {children}
    </button>
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
