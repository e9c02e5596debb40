import { useSignal } from "@preact/signals";
import { useEffect } from "preact/hooks";
import { useStore } from "../../store/store";
import type { ParameterDocument } from "../../stream/documents";
import { Button, Form, keptAs, Select, Typed } from "../../ui/controls";
import { Panel } from "../../ui/Panel";
import { Obstacle, Steer, TaskLine } from "../../ui/Steer";
import { useTask } from "../../ui/useTask";
import { type Draft, draftOf, isNumber, labelOf, readingOf, spanOf, unitOf } from "./fields";
import "./ReconstructionView.css";

/** How images become moments and moments become returns; changed while frames come. */
export function ReconstructionView() {
  const { reconstruction } = useStore();
  const task = useTask();
  /** What was typed, and the version that it began with; null while nothing was. */
  const typed = useSignal<{ readonly draft: Draft; readonly tag: string | null } | null>(null);
  useEffect(() => void reconstruction.refresh(), [reconstruction]);
  const current = reconstruction.document.value;
  const parameters = current?.parameters ?? [];
  const draft = typed.value?.draft ?? draftOf(parameters);
  const reading = readingOf(parameters, draft);
  const wrong = "wrong" in reading ? reading : null;
  const set = (name: string, text: string): void => {
    task.dismiss();
    typed.value = { draft: { ...draft, [name]: text }, tag: typed.peek()?.tag ?? current?.tag ?? null };
  };
  const apply = async (settings: Record<string, unknown>, tag: string | null): Promise<void> => {
    if (await task.run("Applying…", () => reconstruction.set(settings, tag))) typed.value = null;
  };
  return (
    <Panel
      tools={
        <Steer
          title="Smoothing, bias and all else as the daemon has them by default"
          task={task}
          disabled={current === null}
          onClick={() => void apply({}, current?.tag ?? null)}
        >
          The defaults
        </Steer>
      }
    >
      <Form
        class="panel-body column grow fades"
        onSubmit={() => {
          if ("settings" in reading) void apply(reading.settings, typed.peek()?.tag ?? current?.tag ?? null);
        }}
      >
        {reconstruction.trouble.value !== null && <p class="refusal">{reconstruction.trouble.value}</p>}
        <div class="parameter-fields">
          {parameters.map((parameter) => (
            <Parameter
              key={parameter.name}
              parameter={parameter}
              text={draft[parameter.name] ?? ""}
              wrong={wrong?.wrong === parameter.name}
              onInput={(text) => set(parameter.name, text)}
            />
          ))}
        </div>
        <Obstacle />
        {wrong !== null && <p class="refusal">{wrong.words}</p>}
        <TaskLine task={task} field="reconstruction-status" />
        {typed.value !== null && (
          <div class="editor-actions row at-end">
            <Button
              onClick={() => {
                typed.value = null;
                task.dismiss();
              }}
            >
              Undo
            </Button>
            <Steer type="submit" class="primary" disabled={wrong !== null} task={task}>
              Apply
            </Steer>
          </div>
        )}
      </Form>
    </Panel>
  );
}

type ParameterProps = Readonly<{ parameter: ParameterDocument; text: string; wrong: boolean; onInput: (text: string) => void }>;

/** One thing that can be set. */
function Parameter({ parameter, text, wrong, onInput }: ParameterProps) {
  const { name, allowed } = parameter;
  const description = parameter.description.replaceAll("`", ""); // written for documents, too
  const choices = allowed ?? (parameter.type === "boolean" ? ["true", "false"] : []);
  return (
    <label class="field" title={description}>
      <span class="small quiet">{labelOf(name)}</span>
      {choices.length > 0 ? (
        <Select name={name} value={text} of={choices.map(String)} text={(choice) => choice.replaceAll("-", " ")} onChoose={onInput} />
      ) : (
        <span class="field-input row">
          <Typed text={keptAs(text, onInput)} name={name} inputMode={isNumber(parameter) ? "decimal" : "text"} aria-invalid={wrong} />
          <span class="quiet">{unitOf(parameter)}</span>
        </span>
      )}
      <small class="quiet field-description">{description}</small>
      {isNumber(parameter) && <small class="quiet">{spanOf(parameter)}</small>}
    </label>
  );
}
