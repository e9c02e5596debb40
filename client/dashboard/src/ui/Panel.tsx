import type { ComponentChildren } from "preact";

interface PanelProps {
  readonly name: string;
  readonly title: ComponentChildren;
  readonly tools?: ComponentChildren;
  readonly children: ComponentChildren;
}

/** The frame around a view: a title, its tools, its content. */
export function Panel({ name, title, tools, children }: PanelProps) {
  return (
    <section class={`panel panel-${name}`} aria-label={name} data-view={name}>
      <header class="panel-head">
        <div class="panel-title">{title}</div>
        {tools !== undefined && <div class="panel-tools">{tools}</div>}
      </header>
      {children}
    </section>
  );
}
