// SPDX-License-Identifier: MIT
// Steps of a self-test: texts for the user, and when each is shown.

interface Step {
  until: number; // part of the test, 0 to 1
  text: string;
}

const kHeadsetSteps: readonly Step[] = [
  { until: 0.25, text: "Hold both hands up, where you see them" },
  { until: 0.55, text: "Push the cloth with your hands" },
  { until: 0.9, text: "Pinch the cloth, hold it and pull" },
  { until: 1, text: "Look around" },
];
const kWindowSteps: readonly Step[] = [{ until: 1, text: "Leave this window in front" }];

// `part` of the test is over.
export function stepText(inHeadset: boolean, part: number): string {
  const steps = inHeadset ? kHeadsetSteps : kWindowSteps;
  return (steps.find(({ until }) => part < until) ?? steps.at(-1)!).text;
}
