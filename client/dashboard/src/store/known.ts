import { signal } from "@preact/signals";
import { refusalIn } from "./api";

/** A document of the service, as the page last read it. */
export class Known<T> {
  /** Null before it was read. */
  readonly document = signal<T | null>(null);
  /** Why it cannot be had; null if it can. */
  readonly trouble = signal<string | null>(null);

  constructor(private readonly read: () => Promise<T>) {}

  async refresh(): Promise<void> {
    try {
      this.document.value = await this.read();
      this.trouble.value = null;
    } catch (error) {
      this.trouble.value = refusalIn(error).message;
    }
  }

  /** Reads it anew where it was read before: something of it may have changed. */
  async keepUp(): Promise<void> {
    if (this.document.peek() !== null) await this.refresh();
  }

  /** Reads it anew once a request is answered that changes it. */
  protected async after<Answer>(request: Promise<Answer>): Promise<Answer> {
    const answer = await request;
    await this.refresh();
    return answer;
  }
}
