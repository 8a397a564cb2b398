set encoding utf8
set terminal pngcairo noenhanced size 960,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'wrong-gate-round-gates.png'
set datafile separator comma
set title 'Wrong gates among the frames let through (validity as the bundle says), round gates'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key top left
set xlabel 'frames with a gate let through [%]'
set xrange [40:100]
set ylabel 'of these, centre more than 0.5 m off [%]'
set yrange [0:*]
plot 'wrong-gate-round-gates.csv' skip 1 every ::0::60 using 2:3 with lines lw 2 lc rgb '#0072b2' title 'prior', \
     'wrong-gate-round-gates.csv' skip 1 every ::61::121 using 2:3 with lines lw 2 lc rgb '#0072b2' dt 2 title 'prior, on no gate at all', \
     'wrong-gate-round-gates.csv' skip 1 every ::122::182 using 2:3 with lines lw 2 lc rgb '#d55e00' title 'first look', \
     'wrong-gate-round-gates.csv' skip 1 every ::183::243 using 2:3 with lines lw 2 lc rgb '#d55e00' dt 2 title 'first look, on no gate at all'
