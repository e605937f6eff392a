// Keys and mouse, while a program asks for them.
import { inputFor, pushInput, type MouseButton } from "../state/input";

const BUTTONS: readonly MouseButton[] = ["left", "middle", "right"];

/** Listens to events until it is disposed of. */
export class InputReport {
  /** Keys that are held down, by their code. */
  private readonly down = new Map<string, string>();
  private readonly listening = new AbortController();
  private readonly ends: (() => void)[] = [];

  constructor(private readonly canvas: HTMLElement) {
    const { signal } = this.listening;
    window.addEventListener("keydown", (event) => this.press(event), { signal });
    window.addEventListener("keyup", (event) => this.release(event.code, event.key), { signal });
    // The page does not receive releases in another window.
    window.addEventListener("blur", () => this.releaseAll(), { signal });
    canvas.addEventListener("pointermove", (event) => this.point(event, null, false), { signal });
    canvas.addEventListener("pointerdown", (event) => this.point(event, BUTTONS[event.button] ?? null, true), { signal, capture: true });
    canvas.addEventListener("pointerup", (event) => this.point(event, BUTTONS[event.button] ?? null, false), { signal });
    this.ends.push(
      inputFor.subscribe((program) => {
        if (program === null) this.down.clear();
      }),
    );
  }

  dispose(): void {
    this.listening.abort();
    for (const end of this.ends) end();
  }

  private press(event: KeyboardEvent): void {
    if (inputFor.peek() === null || event.isComposing || isTyped(event.target)) return;
    // Keys neither scroll the page nor press a button; the browser's shortcuts stay, and so does the page's
    // help key.
    if (!event.ctrlKey && !event.altKey && !event.metaKey && !/^(Tab|F\d+|\?)$/.test(event.key)) event.preventDefault();
    if (event.repeat || this.down.has(event.code)) return;
    this.down.set(event.code, event.key);
    pushInput({ kind: "key", key: event.key, code: event.code, isDown: true });
  }

  private release(code: string, key: string): void {
    if (!this.down.delete(code) || inputFor.peek() === null) return;
    pushInput({ kind: "key", key, code, isDown: false });
  }

  private releaseAll(): void {
    for (const [code, key] of [...this.down]) this.release(code, key);
  }

  private point(event: PointerEvent, button: MouseButton | null, isDown: boolean): void {
    if (inputFor.peek() === null || !event.isPrimary) return;
    const box = this.canvas.getBoundingClientRect();
    pushInput({ kind: "mouse", x: event.clientX - box.left, y: event.clientY - box.top, button, isDown });
  }
}

/** Whether keys belong to a field or a dialog of the page. */
function isTyped(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.isContentEditable || target.closest("dialog[open]") || target.matches("textarea, select")) return true;
  return target instanceof HTMLInputElement && target.type !== "range";
}
