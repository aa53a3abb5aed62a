"""The look of the page: dark or light as the reader's system is."""

STYLE = """
:root { color-scheme: light dark; --paper: #faf9f6; --ink: #202024; --soft: #6b6b72; --line: #dddcd6; --card: #ffffff;
  --cost: #c8452f; --gain: #3566c4; --plain: #8a7fb5; }
@media (prefers-color-scheme: dark) { :root { --paper: #17171a; --ink: #e8e6e1; --soft: #9d9ca3; --line: #36363c;
  --card: #1f1f23; --cost: #f0745c; --gain: #7aa5f5; --plain: #a99fd8; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 15px/1.5 system-ui, sans-serif; }
main { max-width: 1380px; margin: 0 auto; padding: 28px 24px 80px; }
h1 { font-size: 26px; margin: 0 0 4px; } h2 { font-size: 20px; margin: 44px 0 6px; }
h3 { font-size: 16px; margin: 0 0 8px; } small { color: var(--soft); font-weight: normal; font-size: 13px; }
p { margin: 4px 0 12px; max-width: 90ch; } .note { color: var(--soft); }
header dl { display: flex; flex-wrap: wrap; gap: 12px; margin: 16px 0 0; }
header dl div { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 8px 18px; }
header dt { color: var(--soft); font-size: 13px; } header dd { margin: 0; font-size: 22px; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-size: 13.5px; }
th { text-align: left; font-weight: 600; } thead th { color: var(--soft); font-size: 12.5px; padding: 2px 8px; }
tbody th, td { border-top: 1px solid var(--line); padding: 5px 8px; vertical-align: middle; }
tbody th small { display: block; max-width: 34ch; line-height: 1.3; }
.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
thead tr:last-child th { text-align: right; }
.set { font: 12px/1.35 ui-monospace, monospace; color: var(--soft); white-space: nowrap; }
.group { border-left: 1px solid var(--line); }
.ladder { max-width: 1000px; } .ladder .bar { width: 320px; } .terms .bar { width: 84px; }
.bar { display: inline-block; height: 11px; background: var(--line); border-radius: 3px; overflow: hidden; }
.bar i { display: block; height: 100%; } i.cost { background: var(--cost); } i.gain { background: var(--gain); }
i.plain { background: var(--plain); } b.cost { color: var(--cost); } b.gain { color: var(--gain); }
.dot { display: inline-block; width: 9px; height: 9px; border-radius: 50%; border: 2px solid var(--plain);
  margin-right: 7px; } .dot.on { background: var(--plain); }
a { color: inherit; text-decoration-color: var(--plain); text-underline-offset: 3px; }
.strip { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 500px), 1fr)); gap: 16px; }
figure { margin: 0; } img { width: 100%; height: auto; display: block; border-radius: 4px; image-rendering: pixelated; }
figcaption { font-size: 13px; color: var(--soft); margin-top: 5px; } figcaption b { color: var(--ink); }
.scale { display: flex; align-items: center; gap: 8px; margin-top: 4px; font-size: 12px; }
.scale i { flex: 1; max-width: 260px; height: 9px; border-radius: 2px; background: GRADIENT; }
article { background: var(--card); border: 1px solid var(--line); border-radius: 10px; padding: 14px 16px 16px;
  margin: 0 0 16px; }
.definitions { display: grid; grid-template-columns: max-content 1fr; gap: 4px 18px; } .definitions dd { margin: 0; }
.definitions dt { font-family: ui-monospace, monospace; font-size: 13px; }
"""
"""CSS; GRADIENT stands for the colour bar of the signed errors."""
