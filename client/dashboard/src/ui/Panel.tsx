import { type ComponentChildren, createContext } from "preact";
import { useContext } from "preact/hooks";

import { type Action, type ActionGroup, ActionMenu } from "./ActionMenu";
import type { PlotWords } from "./drawing";
import { plotFiles } from "./plotFiles";
import "./Panel.css";

interface PanelProps {
  /** In place of the view's own title. */
  readonly title?: ComponentChildren;
  readonly tools?: ComponentChildren;
  /** Files that can be made of what the view shows. */
  readonly downloads?: readonly Action[];
  /** What is written around its plot in a figure. */
  readonly plot?: (() => PlotWords) | undefined;
  readonly children: ComponentChildren;
}

/** The type of what is dragged: the name of a view. */
export const DRAGGED = "application/x-transientcam-view";

/** The view of a place by name and title, and what its panel may do there. */
export const SlotContext = createContext<{ readonly name: string; readonly title: string; readonly groups: readonly ActionGroup[] }>({
  name: "",
  title: "",
  groups: [],
});

/** The frame around a view: a title, its tools, its content. */
export function Panel({ title, tools, downloads = [], plot, children }: PanelProps) {
  const { name, title: known, groups } = useContext(SlotContext);
  const files = [...(plot === undefined ? [] : plotFiles(name, plot)), ...downloads];
  return (
    <section class={`panel column panel-${name}`} aria-label={known} data-view={name}>
      <header class="panel-head row apart">
        {/* onto another panel, to change places with it; the menu does the same */}
        <div class="panel-title grow" draggable onDragStart={(event) => event.dataTransfer?.setData(DRAGGED, name)}>
          {title ?? <h2>{known}</h2>}
        </div>
        <div class="panel-tools wrapped spaced">
          {tools}
          <ActionMenu label={`Panel ${name}: views and downloads`} groups={[{ title: "Download", actions: files }, ...groups]} />
        </div>
      </header>
      {children}
    </section>
  );
}
