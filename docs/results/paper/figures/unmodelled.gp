set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'unmodelled.png'
set datafile separator comma
set title 'A vehicle that is not what its file says, in wind'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'speed limit [m/s]'
set xrange [4.85:8.15]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'unmodelled.csv' skip 1 every ::0::2 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'mass +10 %, drag x1.5, rotor lag x1.5, wind 4 m/s', \
     'unmodelled.csv' skip 1 every ::0::2 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle
