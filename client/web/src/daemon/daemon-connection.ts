// The page's connection to its daemon: polls states, detects a lost daemon, and reconnects.
import { Code, ConnectError } from "@connectrpc/connect";
import { batch } from "@preact/signals";
import { pictureInterval } from "../state/picture";
import { contactsWanted } from "../state/view";
import { isStill } from "../state/stillness";
import { connection, daemonName, frame, isRole, limits, robots, role, tokenName, type Frame } from "../state/world";
import { offerAgain } from "./again";
import { retryDelay } from "./backoff";
import { PollLoop } from "./poll-loop";
import { frameOf, layoutsOf, limitsOf } from "./mapping";
import { isTimeout, messageOf } from "./error-message";
import { RobotRegistry } from "./robot-registry";
import type { Services } from "./services";
import { DaemonPoller } from "./daemon-poller";
import { ViewLink } from "./view-link";

/** Milliseconds between the starts of two calls: 60 states a second. */
const INTERVAL = 1000 / 60;
/** Number of calls for each picture of a page that draws slowly: more states would only take time from its pictures. */
const STATES_A_PICTURE = 2;
/** Maximum milliseconds between two calls of such a page. */
const SLOWEST_INTERVAL = 100;
/** Seconds that the daemon waits for a newer state. */
const WAIT = 0.02;
/** Number of consecutive responses without a new state after which the world counts as idle. */
const IDLE_AFTER = 5;
/** Number of consecutive states without motion after which the world counts as still: only its time advances. */
const STILL_AFTER = 30;
/**
 * Milliseconds between two calls while the world is idle or still, and seconds that the daemon waits in an idle one. No connection is held for it.
 */
const IDLE_INTERVAL = 250;
const IDLE_WAIT = 0.001;
/** Milliseconds without a response after which the daemon is lost. */
const TIMEOUT = 5000;
/** Milliseconds by which timers are late at least while the page does something else. */
const LATE = 100;

/** Writes received data into the signals of `state`. */
export class DaemonConnection {
  private readonly registry: RobotRegistry;
  private readonly states = new PollLoop(() => this.run());
  private readonly poller: DaemonPoller;
  private readonly slow: PollLoop;
  private readonly view: ViewLink;
  private sequence = 0n;
  /** Sequence of the state to which the daemon sends changes. */
  private newest: Frame | null = null;
  /** The next response counts as new even if its sequence is not: the request differs from the last one. */
  private forceNew = true;
  private unchanged = 0;
  /** Number of states without motion since `reference`. */
  private still = 0;
  /** The last state with motion; a slow motion adds up against it. */
  private reference: Frame | null = null;
  private failures = 0;
  private due = 0;
  /** Robots of the lost daemon, until a daemon is found. */
  private before: string[] | null = null;
  /** Whether the found daemon is another one. */
  private isAnother = false;

  constructor(private readonly services: Services) {
    this.registry = new RobotRegistry(services, () => this.refresh());
    this.poller = new DaemonPoller(services, this.registry, () => this.rests());
    this.slow = new PollLoop(() => this.poller.poll());
    this.view = new ViewLink(services);
    // Contacts are requested only if they are drawn or plotted, and an idle world has to be polled again for them.
    contactsWanted.subscribe(() => this.refresh());
  }

  /** Starts polling, or stops it while the page is hidden. */
  setVisible(visible: boolean): void {
    // Another daemon may have come meanwhile, whose values are unknown.
    this.forceNew = true;
    for (const loop of [this.states, this.slow]) {
      if (visible) loop.start();
      else loop.stop();
    }
    this.view.setVisible(visible);
  }

  /** Polls an idle or still world at once after a change by this page. */
  pollNow(): void {
    const rests = this.rests();
    this.unchanged = 0;
    this.still = 0;
    if (rests && connection.value.state === "live") {
      this.states.wake();
      this.slow.wake();
    }
  }

  /** Polls slow data at once, too. */
  pollAllNow(): void {
    this.pollNow();
    this.slow.wake();
  }

  /** Reconnects to a lost daemon now, without waiting for the next attempt. */
  retry(): void {
    if (connection.value.state === "lost") this.states.wake();
  }

  /** Whether the world is idle or still. */
  private rests(): boolean {
    return this.unchanged >= IDLE_AFTER || this.still >= STILL_AFTER;
  }

  private refresh(): void {
    this.forceNew = true;
    this.pollNow();
  }

  private async run(): Promise<number> {
    const now = performance.now();
    this.due = Math.max(this.due + this.interval(), now);
    try {
      if (connection.value.state !== "live") await this.connect();
      const idle = this.unchanged >= IDLE_AFTER;
      await this.poll(idle ? IDLE_WAIT : WAIT);
    } catch (error) {
      // A picture that takes longer than a call may take holds up the answer, too: the timer is late then.
      if (connection.value.state === "live" && isTimeout(error) && performance.now() - now > TIMEOUT + LATE) return 0;
      return this.disconnect(error);
    }
    return this.rests() ? IDLE_INTERVAL : Math.max(0, this.due - performance.now());
  }

  /** Milliseconds between the starts of two calls in a world that moves. */
  private interval(): number {
    return Math.max(INTERVAL, Math.min(SLOWEST_INTERVAL, pictureInterval.peek() / STATES_A_PICTURE));
  }

  private async connect(isAnother = false): Promise<void> {
    const fetchInfo = () => this.services.simulation.getSimulatorInfo({}, { timeoutMs: TIMEOUT });
    // One call is enough to detect that a lost daemon is still lost.
    if (connection.value.state === "lost") await fetchInfo();
    // Kept while attempts fail: some of them report the restart.
    this.before ??= names();
    this.isAnother ||= isAnother;
    const begin = async (): Promise<void> => {
      const beganAnew = await this.poller.begin();
      this.isAnother ||= beganAnew;
    };
    const [info] = await Promise.all([fetchInfo(), this.registry.load(), begin()]);
    if (this.isAnother) offerAgain(this.before, names());
    this.before = null;
    this.isAnother = false;
    this.sequence = 0n;
    this.newest = null;
    this.forceNew = true;
    this.unchanged = 0;
    this.still = 0;
    this.reference = null;
    this.failures = 0;
    batch(() => {
      daemonName.value = info.name;
      limits.value = info.limits ? limitsOf(info.limits) : null;
      role.value = isRole(info.token?.role) ? info.token.role : null;
      tokenName.value = info.token?.name ?? "";
      connection.value = { state: "live", reason: "", retryAt: 0 };
    });
    this.slow.wake();
    this.view.begin();
  }

  private async poll(timeout: number): Promise<void> {
    const { forceNew } = this;
    this.forceNew = false;
    const response = await this.services.joints.nextJointStates(
      {
        afterSequence: forceNew ? 0n : this.sequence,
        timeout,
        returnLinkPoses: true,
        returnContacts: contactsWanted.value,
        changesSince: forceNew || !this.newest ? 0n : this.sequence,
      },
      { timeoutMs: TIMEOUT },
    );
    const sequence = response.states?.stamp?.sequence ?? 0n;
    if (sequence < this.sequence) {
      // A state older than the last one comes from another daemon, started between two calls.
      await this.connect(true);
      return;
    }
    void this.registry.update(layoutsOf(response));
    if (sequence === this.sequence && !forceNew) {
      this.unchanged += 1;
      return;
    }
    const rested = this.rests();
    this.unchanged = 0;
    this.sequence = sequence;
    const next = frameOf(response, this.registry.layouts(), performance.now(), forceNew ? null : this.newest);
    if (!next) return;
    this.newest = next;
    // The response omits a robot that an earlier response left out, because its layout was unknown.
    if (response.states?.robots.some(({ robot, unchanged }) => unchanged && !next.joints.has(robot))) this.forceNew = true;
    this.compare(next);
    frame.value = next;
    // Another client may have started this motion.
    if (rested && !this.rests()) this.slow.wake();
  }

  /** Counts states without motion. */
  private compare(next: Frame): void {
    if (this.reference && isStill(this.reference, next)) {
      this.still += 1;
    } else {
      this.still = 0;
      this.reference = next;
    }
  }

  private disconnect(error: unknown): number {
    this.failures += 1;
    const delay = retryDelay(this.failures);
    const needsToken = error instanceof ConnectError && error.code === Code.Unauthenticated;
    connection.value = { state: "lost", reason: messageOf(error), retryAt: performance.now() + delay, needsToken };
    return delay;
  }
}

function names(): string[] {
  return robots.peek().map(({ name }) => name);
}
