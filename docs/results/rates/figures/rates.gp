set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'rates.png'
set datafile separator comma
set title 'Through a rate loop: rates'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'speed limit [m/s]'
set xrange [5.6:14.4]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'rates.csv' skip 1 every ::0::6 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'body rates', \
     'rates.csv' skip 1 every ::0::6 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'rates.csv' skip 1 every ::7::13 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'rotor thrusts', \
     'rates.csv' skip 1 every ::7::13 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle
