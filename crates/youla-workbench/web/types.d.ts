// What the page has besides these scripts: the helpers of the report (youla-report, assets/figures/base.js) and the two libraries.

declare const uPlot: any;
declare const wasiShim: any;
declare function element(tag: string, attributes?: Record<string, any>, ...children: any[]): any;
declare function chooser(label: string, options: string[], changed: (place: number) => void, chosen?: number): any;
declare const colour: (name: string) => string;
declare const prettyUnit: (unit: string) => string;
declare function readOut(value: number | null | undefined): string;
declare function logSplits(low: number, high: number): number[];
declare function logLabels(splits: number[]): string[];
