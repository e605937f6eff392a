// The page's link to its daemon: asks for states, notices when nobody answers, and finds the way back.
import { batch } from "@preact/signals";
import { contacts } from "../state/view";
import { connection, daemonName, frame } from "../state/world";
import { retryDelay } from "./backoff";
import { Loop } from "./loop";
import { frameOf, layoutsOf } from "./mapping";
import { sentenceOf } from "./refusal";
import { Roster } from "./roster";
import type { Services } from "./services";
import { Surroundings } from "./surroundings";

/** Milliseconds between the beginnings of two calls: sixty states a second. */
const INTERVAL = 1000 / 60;
/** Seconds that the daemon waits for a newer state. */
const WAIT = 0.02;
/** So many answers in a row without anything new, and the world is taken to rest. */
const PATIENCE = 5;
/** Milliseconds between two calls while it rests: no connection is held for it. */
const REST_INTERVAL = 250;
const REST_WAIT = 0.001;
/** Milliseconds after which a daemon that holds its tongue is lost. */
const TIMEOUT = 5000;

/** One page's link. All that it learns goes into the signals of `state`. */
export class Link {
  private readonly roster: Roster;
  private readonly states = new Loop(() => this.turn());
  private readonly surroundings: Surroundings;
  private readonly others: Loop;
  private sequence = 0n;
  /** The next answer is taken as new, whatever it is: it is asked for something else than the one before. */
  private afresh = true;
  private unchanged = 0;
  private failures = 0;
  private due = 0;

  constructor(private readonly services: Services) {
    this.roster = new Roster(services, () => this.refresh());
    this.surroundings = new Surroundings(services, this.roster);
    this.others = new Loop(() => this.surroundings.turn());
    // Contacts come only where they are drawn, and a world at rest has to be asked anew.
    contacts.subscribe(() => this.refresh());
  }

  /** Asks from now on; nothing is asked while the page is hidden. */
  setVisible(visible: boolean): void {
    for (const loop of [this.states, this.others]) {
      if (visible) loop.start();
      else loop.stop();
    }
  }

  /** Something was changed: a world that rested is asked at once. */
  poke(): void {
    const rested = this.unchanged >= PATIENCE;
    this.unchanged = 0;
    if (rested && connection.value.state === "live") this.states.wake();
  }

  /** How the world runs was changed, which is asked for more slowly. */
  pokeAll(): void {
    this.poke();
    this.others.wake();
  }

  /** Tries a lost daemon now. */
  retry(): void {
    if (connection.value.state === "lost") this.states.wake();
  }

  private refresh(): void {
    this.afresh = true;
    this.poke();
  }

  private async turn(): Promise<number> {
    const now = performance.now();
    this.due = Math.max(this.due + INTERVAL, now);
    try {
      if (connection.value.state !== "live") await this.greet();
      const resting = this.unchanged >= PATIENCE;
      await this.ask(resting ? REST_WAIT : WAIT);
    } catch (error) {
      return this.lose(error);
    }
    return this.unchanged >= PATIENCE ? REST_INTERVAL : Math.max(0, this.due - performance.now());
  }

  private async greet(): Promise<void> {
    const ask = () => this.services.simulation.getSimulatorInfo({}, { timeoutMs: TIMEOUT });
    // One call is enough to find out that a lost daemon is still lost.
    if (connection.value.state === "lost") await ask();
    const [info] = await Promise.all([ask(), this.roster.load(), this.surroundings.begin()]);
    this.sequence = 0n;
    this.afresh = true;
    this.unchanged = 0;
    this.failures = 0;
    batch(() => {
      daemonName.value = info.name;
      connection.value = { state: "live", reason: "", retryAt: 0 };
    });
    this.others.wake();
  }

  private async ask(timeout: number): Promise<void> {
    const { afresh } = this;
    this.afresh = false;
    const response = await this.services.joints.nextJointStates(
      { afterSequence: afresh ? 0n : this.sequence, timeout, returnLinkPoses: true, returnContacts: contacts.value },
      { timeoutMs: TIMEOUT },
    );
    const sequence = response.states?.stamp?.sequence ?? 0n;
    if (sequence < this.sequence) {
      // A daemon whose states are older than what we have is another one, come in between two calls.
      await this.greet();
      return;
    }
    void this.roster.see(layoutsOf(response));
    if (sequence === this.sequence && !afresh) {
      this.unchanged += 1;
      return;
    }
    this.unchanged = 0;
    this.sequence = sequence;
    const next = frameOf(response, this.roster.layouts(), performance.now());
    if (next) frame.value = next;
  }

  private lose(error: unknown): number {
    this.failures += 1;
    const delay = retryDelay(this.failures);
    connection.value = { state: "lost", reason: sentenceOf(error), retryAt: performance.now() + delay };
    return delay;
  }
}
