set encoding utf8
set terminal pngcairo noenhanced size 960,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'risk-round-gates.png'
set datafile separator comma
set title 'What is left when the worst predicted frames are given up, round gates'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key top left
set xlabel 'frames kept [%]'
set ylabel 'mean error within 1 m of the gate [m]'
set yrange [0:*]
plot 'risk-round-gates.csv' skip 1 every ::0::99 using 2:3 with lines lw 2 lc rgb '#0072b2' title 'prior', \
     'risk-round-gates.csv' skip 1 every ::100::199 using 2:3 with lines lw 2 lc rgb '#0072b2' dt 2 title 'prior, if the errors were known', \
     'risk-round-gates.csv' skip 1 every ::200::299 using 2:3 with lines lw 2 lc rgb '#d55e00' title 'first look', \
     'risk-round-gates.csv' skip 1 every ::300::399 using 2:3 with lines lw 2 lc rgb '#d55e00' dt 2 title 'first look, if the errors were known'
