// Draws one plot a scene from the data in the page. Everything else is there without a script.
(function () {
  "use strict";
  var data = JSON.parse(document.getElementById("data").textContent);
  var dashes = { float: "dash", double: "solid", "double-float": "dot" };
  var symbols = { float: "circle-open", double: "circle", "double-float": "square" };
  var least = 1e-16; // what is exact is drawn here: a logarithm has no zero

  function short(x) {
    return x === null || x === undefined ? "–" : x === 0 ? "0" : Number(x).toPrecision(3);
  }

  function hover(row) {
    return "<b>" + row.method + "</b>, " + row.precision + (row.setting ? ", " + row.setting : "") +
      "<br>" + (row.tolerance ? "tolerance " + short(row.tolerance) + " m, mean dt = " : "dt = ") + short(row.dt) + " s" +
      "<br>error " + short(row.rms) + " m RMS, " + short(row.worst) + " m at most" +
      "<br>" + short(row.seconds) + " s per simulated second" +
      "<br>energy drift " + short(row.energy_drift) + ", " + short(row.evaluations) + " evaluations";
  }

  function traces(scene) {
    var out = [{
      x: scene.front.map(function (r) { return r.seconds; }),
      y: scene.front.map(function (r) { return Math.max(r.rms, least); }),
      mode: "lines", name: "Pareto front", hoverinfo: "skip", legendrank: 1,
      line: { color: "rgba(255, 205, 80, 0.65)", width: 12 }
    }];
    var named = {};
    scene.series.forEach(function (series) {
      var first = !named[series.method];
      named[series.method] = true;
      out.push({
        x: series.rows.map(function (r) { return r.seconds; }),
        y: series.rows.map(function (r) { return Math.max(r.rms, least); }),
        text: series.rows.map(hover),
        hovertemplate: "%{text}<extra></extra>",
        mode: "lines+markers", name: series.method, legendgroup: series.method, showlegend: first,
        meta: series.precision,
        line: { color: series.color, width: 1.8, dash: dashes[series.precision] || "solid" },
        marker: { color: series.color, size: 8, symbol: symbols[series.precision] || "diamond", line: { width: 1.8, color: series.color } }
      });
    });
    return out;
  }

  function layout(scene) {
    var shapes = [], notes = [];
    if (scene.uncertainty > 0) {
      shapes.push({
        type: "line", xref: "paper", x0: 0, x1: 1, y0: scene.uncertainty, y1: scene.uncertainty,
        line: { color: "#999", width: 1.2, dash: "dot" }
      });
      notes.push({
        xref: "paper", x: 0.004, y: Math.log10(scene.uncertainty), yanchor: "bottom", xanchor: "left", showarrow: false,
        text: "the reference is no surer than this", font: { size: 11, color: "#777" }
      });
    }
    var axis = { type: "log", exponentformat: "power", dtick: 1, gridcolor: "#e6eaef", zeroline: false,
      showline: true, linecolor: "#9aa6b2", mirror: true, ticks: "outside", tickcolor: "#9aa6b2" };
    return {
      margin: { l: 80, r: 10, t: 34, b: 60 }, hovermode: "closest", paper_bgcolor: "#fff", plot_bgcolor: "#fff",
      font: { family: "system-ui, DejaVu Sans, sans-serif", size: 13, color: "#1d2733" },
      hoverlabel: { bgcolor: "#fff", bordercolor: "#9aa6b2", font: { size: 13, color: "#1d2733" }, align: "left" },
      xaxis: Object.assign({ title: { text: "processor time of one thread [s per simulated second]" } }, axis),
      yaxis: Object.assign({ title: { text: scene.ylabel } }, axis),
      legend: { groupclick: "togglegroup", tracegroupgap: 2, itemsizing: "constant", font: { size: 12.5 } },
      shapes: shapes, annotations: notes
    };
  }

  // A mark and a dash as in the plot, beside its name.
  function mark(precision) {
    var dash = { dash: "6 4", solid: "", dot: "2 3" }[dashes[precision] || "solid"];
    var inner = precision === "double-float" ? '<rect x="13" y="3" width="8" height="8" fill="#444"/>'
      : '<circle cx="17" cy="7" r="4" stroke="#444" stroke-width="1.8" fill="' + (precision === "float" ? "#fff" : "#444") + '"/>';
    return '<svg width="34" height="14"><line x1="0" x2="34" y1="7" y2="7" stroke="#444" stroke-width="1.8" stroke-dasharray="' +
      dash + '"/>' + inner + "</svg>";
  }

  function toggles(box, plot, precisions) {
    box.insertAdjacentHTML("beforeend", "<span>Show:</span>");
    precisions.forEach(function (precision) {
      box.insertAdjacentHTML("beforeend", '<label><input type="checkbox" checked value="' + precision + '">' +
        mark(precision) + precision + "</label>");
    });
    box.insertAdjacentHTML("beforeend", "<span>A click on a method hides it, a double click shows it alone.</span>");
    box.addEventListener("change", function (event) {
      var which = [];
      plot.data.forEach(function (trace, i) { if (trace.meta === event.target.value) which.push(i); });
      Plotly.restyle(plot, { opacity: event.target.checked ? 1 : 0,
        hoverinfo: event.target.checked ? "text" : "skip" }, which);
    });
  }

  data.scenes.forEach(function (scene) {
    var plot = document.getElementById("plot-" + scene.name);
    if (!plot) return; // no run gave an answer
    Plotly.newPlot(plot, traces(scene), layout(scene), { responsive: true, displaylogo: false, showTips: false,
      modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"] });
    var precisions = [];
    scene.series.forEach(function (s) { if (precisions.indexOf(s.precision) < 0) precisions.push(s.precision); });
    toggles(document.getElementById("tools-" + scene.name), plot, precisions);
  });
  document.documentElement.setAttribute("data-ready", "yes");
})();
