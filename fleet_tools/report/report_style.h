// The look of the report page.
#pragma once

namespace comap {

inline constexpr const char* kReportStyle = R"css(
:root{color-scheme:light dark;
--bg:#f6f7f9;--card:#fff;--ink:#1a1f27;--soft:#5d6875;--line:#e1e5ea;--good:#187a45;--bad:#b3372a;}
@media (prefers-color-scheme:dark){:root{
--bg:#12151a;--card:#1b2027;--ink:#e8ecf1;--soft:#9aa6b4;--line:#2d343e;--good:#5cc98e;--bad:#f08a7d;}}
*{box-sizing:border-box}
body{margin:0;background:var(--bg);color:var(--ink);
font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif}
main{max-width:1080px;margin:0 auto;padding:32px 20px 64px}
h1{font-size:28px;line-height:1.2;margin:0 0 4px;letter-spacing:-.01em}
h2{font-size:18px;margin:40px 0 12px}
h3{font-size:14px;font-weight:600;color:var(--soft);margin:16px 0 6px;overflow-wrap:anywhere}
.sub{color:var(--soft);margin:0 0 24px}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(138px,1fr));gap:12px}
.card,section.box,figure{background:var(--card);border:1px solid var(--line);border-radius:10px}
.card{padding:14px 16px}
.card b{display:block;font-size:23px;font-weight:650;line-height:1.2;font-variant-numeric:tabular-nums}
.card span{color:var(--soft);font-size:13px}
.good{color:var(--good)}.bad{color:var(--bad)}
section.box{padding:4px 16px;overflow-x:auto}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
th{font-size:12.5px;font-weight:600;color:var(--soft);text-align:left;vertical-align:bottom}
th,td{padding:8px 14px 8px 0;border-bottom:1px solid var(--line);vertical-align:top}
tr:last-child td{border-bottom:0}
td.n,th.n{text-align:right}
td.w{overflow-wrap:anywhere}
td.m,th.m{white-space:nowrap}
.bar{height:9px;border-radius:5px;background:var(--soft);min-width:2px}.bar.ok{background:var(--good)}
.pictures{display:grid;grid-template-columns:repeat(auto-fit,minmax(320px,1fr));gap:16px}
.pairs{display:grid;grid-template-columns:1fr 1fr;gap:16px}
figure{margin:0;overflow:hidden}
figure img{display:block;width:100%;height:auto;background:#0b0d10}
figcaption{padding:9px 14px;color:var(--soft);font-size:13.5px;overflow-wrap:anywhere}
svg.plot{display:block;width:100%;height:auto}
svg .grid line{stroke:var(--line);stroke-width:1}
svg .axis text{fill:var(--soft);font-size:11px}
svg polyline{fill:none;stroke:currentColor;stroke-width:2.2;stroke-linejoin:round;stroke-linecap:round}
svg polyline.truth{stroke-width:1.4;stroke-dasharray:5 4;opacity:.8}
svg .merge{color:var(--ink)}svg .merge line{stroke:currentColor;stroke-width:1.6}
svg .merge text{fill:currentColor;font-size:12px}
svg .undone{color:var(--bad)}svg .undone line{stroke-dasharray:4 4}
figcaption .legend{margin:4px 0 0}
svg circle{fill:var(--card);stroke:currentColor;stroke-width:2.2}svg rect{fill:currentColor}
.legend{display:flex;flex-wrap:wrap;gap:6px 20px;margin:10px 0;color:var(--soft);font-size:13.5px}
.legend i{display:inline-block;width:18px;height:4px;border-radius:2px;background:currentColor;
margin-right:7px;vertical-align:middle}
pre{overflow:auto;font:12.5px/1.45 ui-monospace,Menlo,Consolas,monospace;margin:8px 0}
summary{cursor:pointer;padding:8px 0;color:var(--soft)}
@media print{body{background:#fff}.card,section.box,figure{break-inside:avoid}}
)css";

}  // namespace comap
