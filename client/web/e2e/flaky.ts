// Reports tests that failed and then passed, with the failure, at the end of the run and in the notes of `make test`.

import { appendFileSync } from "node:fs";

import type { Reporter, TestCase } from "vitest/node";

/** Lists flaky tests. Each must be fixed at its cause, or deleted. */
export class Flaky implements Reporter {
  private readonly names: string[] = [];

  onTestCaseResult(test: TestCase): void {
    if (test.diagnostic()?.flaky !== true) return;
    const file = test.module.moduleId.split("/").at(-1);
    const [error] = test.result().errors ?? [];
    const line = error?.stacks?.find(({ file: at }) => at.endsWith(`/${file}`))?.line;
    this.names.push(`${file}: ${test.fullName}\n    ${line === undefined ? "" : `line ${line}: `}${error?.message.split("\n", 1)[0] ?? "without an error"}`);
  }

  onTestRunEnd(): void {
    if (this.names.length === 0) return;
    const text = `flaky (failed, then passed):\n${this.names.map((name) => `  ${name}\n`).join("")}`;
    process.stdout.write(`\n${text}`);
    const notes = process.env.NOTES;
    if (notes !== undefined) appendFileSync(notes, text);
  }
}
