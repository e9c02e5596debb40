import { type ComponentChildren, createContext } from "preact";
import { useContext } from "preact/hooks";

import { type Action, type ActionGroup, ActionMenu } from "./ActionMenu";
import type { PlotWords } from "./drawing";
import { plotFiles } from "./plotFiles";
import "./Panel.css";

interface PanelProps {
  readonly name: string;
  readonly title: ComponentChildren;
  readonly tools?: ComponentChildren;
  /** Files that can be made of what the view shows. */
  readonly downloads?: readonly Action[];
  /** What is written around its plot in a figure. */
  readonly plot?: (() => PlotWords) | undefined;
  readonly children: ComponentChildren;
}

/** The type of what is dragged: the name of a view. */
export const DRAGGED = "application/x-transientcam-view";

/** What a panel may do with its place on the page. */
export const SlotContext = createContext<readonly ActionGroup[]>([]);

/** The frame around a view: a title, its tools, its content. */
export function Panel({ name, title, tools, downloads = [], plot, children }: PanelProps) {
  const slot = useContext(SlotContext);
  const files = [...(plot === undefined ? [] : plotFiles(name, plot)), ...downloads];
  return (
    <section class={`panel column panel-${name}`} aria-label={name} data-view={name}>
      <header class="panel-head row apart">
        {/* onto another panel, to change places with it; the menu does the same */}
        <div class="panel-title grow" draggable onDragStart={(event) => event.dataTransfer?.setData(DRAGGED, name)}>
          {title}
        </div>
        <div class="panel-tools wrapped spaced">
          {tools}
          <ActionMenu label={`Panel ${name}: views and downloads`} groups={[{ title: "Download", actions: files }, ...slot]} />
        </div>
      </header>
      {children}
    </section>
  );
}
