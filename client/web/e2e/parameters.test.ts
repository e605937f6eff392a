// The sliders that programs add: their numbers are typed while other parameters change.

import { expect, test } from "vitest";

import { Tab } from "./browser";
import { Daemon } from "./daemon";
import { fixtures } from "./fixtures";

const use = fixtures();

test("a number that is being typed stays as it is while another parameter changes", async () => {
  const daemon = await use.daemon(Daemon.demo());
  for (const name of ["speed", "gain"]) {
    await daemon.parameters.addParameter({ parameter: { name, kind: { case: "slider", value: { minimum: 0, maximum: 1, value: 0.5 } } } });
  }
  const speed = async (): Promise<number> => {
    const { list } = await daemon.parameters.getParameters({});
    const { kind } = list?.parameters.find(({ name }) => name === "speed") ?? {};
    return kind?.case === "slider" ? kind.value.value : NaN;
  };
  const tab = await Tab.open(await use.context(), daemon.url);
  const box = (name: string) => tab.page.getByTestId(`parameter-${name}`).getByTestId("parameter-number");
  await box("speed").click();
  await tab.page.keyboard.press("Control+a");
  await tab.page.keyboard.type("0.");
  await daemon.parameters.setParameters({ changes: [{ name: "gain", change: { case: "value", value: 0.9 } }] });
  await expect.poll(() => box("gain").inputValue()).toBe("0.9");
  expect(await box("speed").inputValue()).toBe("0.");
  await tab.page.keyboard.type("75");
  await tab.page.keyboard.press("Enter");
  await expect.poll(speed).toBe(0.75);
  // Escape restores the old one. So does unreadable text, with a message.
  await tab.page.keyboard.press("Control+a");
  await tab.page.keyboard.type("0.1");
  await tab.page.keyboard.press("Escape");
  await expect.poll(() => box("speed").inputValue()).toBe("0.75");
  await tab.page.keyboard.press("Control+a");
  await tab.page.keyboard.type("fast");
  await tab.page.keyboard.press("Tab");
  await expect.poll(async () => (await tab.page.getByTestId("toast").allTextContents()).join()).toContain('"fast" is not a number');
  expect(await box("speed").inputValue()).toBe("0.75");
  expect(await speed()).toBe(0.75);
});
