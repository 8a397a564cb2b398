set encoding utf8
set terminal pngcairo noenhanced size 960,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'roc-simulation.png'
set datafile separator comma
set title 'Validity: gates kept and empty frames taken for gates, simulation'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key bottom right
set xlabel 'of the empty ones, taken for a gate'
set logscale x
set xrange [0.001:1]
set ylabel 'of the gates, kept'
set yrange [0.7:1]
plot 'roc-simulation.csv' skip 1 every ::0::2367 using 2:3 with lines lw 2 lc rgb '#0072b2' title 'first look: nothing of any gate in view', \
     'roc-simulation.csv' skip 1 every ::2368::4126 using 2:3 with lines lw 2 lc rgb '#d55e00' title 'first look: no valid gate in view', \
     'roc-simulation.csv' skip 1 every ::4127::6826 using 2:3 with lines lw 2 lc rgb '#009e73' title 'prior: a place without a gate'
