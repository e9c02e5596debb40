export interface Action {
  readonly text: string;
  readonly run: () => void;
}

export interface ActionGroup {
  readonly title: string;
  readonly actions: readonly Action[];
}

/** Things to do, behind one small button: the browser's own list, so that keys, touch and readers know it. */
export function ActionMenu({ label, groups }: { label: string; groups: readonly ActionGroup[] }) {
  const filled = groups.filter(({ actions }) => actions.length > 0);
  return (
    <select
      class="action-menu"
      aria-label={label}
      title={label}
      value=""
      onChange={(event) => {
        const [group, action] = event.currentTarget.value.split(".").map(Number);
        event.currentTarget.value = "";
        filled[group].actions[action].run();
      }}
    >
      <option value="" disabled hidden>
        ⋯
      </option>
      {filled.map(({ title, actions }, group) => (
        <optgroup key={title} label={title}>
          {actions.map(({ text }, action) => (
            <option key={text} value={`${group}.${action}`}>
              {text}
            </option>
          ))}
        </optgroup>
      ))}
    </select>
  );
}
