set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'delay.png'
set datafile separator comma
set title 'Success against the link''s delay, position 0.3 m, 8 m/s'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'link delay each way [ms]'
set xrange [-10:210]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'delay.csv' skip 1 every ::0::8 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'with prediction', \
     'delay.csv' skip 1 every ::0::8 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'delay.csv' skip 1 every ::9::12 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'with prediction, vehicle not as told', \
     'delay.csv' skip 1 every ::9::12 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle, \
     'delay.csv' skip 1 every ::13::20 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#009e73' title 'without prediction', \
     'delay.csv' skip 1 every ::13::20 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#009e73' notitle
