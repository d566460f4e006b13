// The look of a certificate: one page of A4, and the same on a screen.
#pragma once

namespace tagwrench {

inline constexpr const char* kCertificateStyle = R"(
@page { size: A4; margin: 11mm 12mm 9mm 12mm }
* { box-sizing: border-box }
html { background: #fff; color: #1a1a1a }
body { margin: 0; font: 6.9pt/1.28 sans-serif }
@media screen { body { width: 186mm; margin: 8mm auto } }
h1 { font-size: 17pt; font-weight: 700; margin: 0; letter-spacing: -0.2pt }
h2 { font-size: 7.2pt; font-weight: 700; margin: 0 0 0.7mm 0; color: #14406b }
p { margin: 0 }
header { display: table; width: 100%; border-bottom: 1.2pt solid #14406b; padding-bottom: 1.6mm; margin-bottom: 2mm }
header > div { display: table-cell; vertical-align: bottom }
header p { font-size: 8pt; color: #555 }
header .id { text-align: right; font-size: 7.2pt }
header .id b { font-size: 9pt }
.columns { display: table; table-layout: fixed; width: 100%; margin-bottom: 2mm }
.columns > section { display: table-cell; width: 50%; vertical-align: top; padding-right: 4mm }
.columns > section:last-child { padding-right: 0 }
.wide-left > section:first-child { width: 62% }
.wide-left > section:last-child { width: 38% }
table { border-collapse: collapse }
.facts th { text-align: left; font-weight: 400; color: #666; padding: 0 3mm 0 0; vertical-align: top; white-space: nowrap }
.facts { table-layout: auto; width: 100% }
.facts th { width: 1% }
.facts td { padding: 0; overflow-wrap: anywhere }
code { font-family: inherit; font-variant-numeric: tabular-nums }
.axes { width: 100%; table-layout: fixed; margin-bottom: 0.6mm; font-size: 6.1pt; font-variant-numeric: tabular-nums }
.axes th { font-weight: 400; color: #666; text-align: right; padding: 0.2mm 0.7mm; vertical-align: bottom; line-height: 1.1 }
.axes thead tr:first-child th { text-align: center; color: #14406b }
.axes thead tr:last-child { border-bottom: 0.6pt solid #14406b }
.axes tbody tr { border-bottom: 0.3pt solid #ccc }
.axes tbody th { text-align: left; vertical-align: middle; font-weight: 700; color: #1a1a1a; font-size: 7.6pt }
.axes td { text-align: right; vertical-align: middle; padding: 0.75mm 0.7mm; white-space: nowrap }
.axes .first { border-left: 0.3pt solid #ccc }
.axes .no { text-align: left; overflow-wrap: anywhere; white-space: normal; color: #a11616; background: #fbf0f0; padding-left: 2mm }
.cross { width: 100%; margin-bottom: 0.4mm; font-size: 6.5pt; font-variant-numeric: tabular-nums }
.cross th { font-weight: 400; color: #666; padding: 0.2mm 0.6mm; text-align: right }
.cross td { text-align: right; padding: 0.35mm 0.6mm; border: 0.3pt solid #ddd }
.cross .self { background: #eee }
.cross .large { font-weight: 700; color: #a11616 }
.note { color: #666; font-size: 6pt; margin-bottom: 2mm }
.scatter svg, .traces svg { display: block; width: 100% }
.traces { margin-bottom: 2mm }
.red { color: #d62728 }
.black { color: #000 }
ul { margin: 0; padding-left: 3mm }
li { overflow-wrap: anywhere }
footer { display: table; width: 100%; border-top: 0.6pt solid #14406b; padding-top: 1mm; font-size: 5.8pt; line-height: 1.25; color: #555 }
footer > div { display: table-cell; vertical-align: top }
footer .sign { width: 52mm; padding-top: 8mm; padding-left: 6mm; text-align: center }
footer .sign::before { content: ""; display: block; border-top: 0.4pt solid #555; margin-bottom: 0.6mm }
)";

}  // namespace tagwrench
