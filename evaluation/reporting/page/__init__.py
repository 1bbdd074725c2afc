"""The page of the report: template, styles and script; and uPlot 1.6.32, which draws its plots."""
