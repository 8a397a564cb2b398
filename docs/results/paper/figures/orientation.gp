set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'orientation.png'
set datafile separator comma
set title 'Success against speed, gates turned or leant'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'speed limit [m/s]'
set xrange [4.55:14.45]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'orientation.csv' skip 1 every ::0::6 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'yaw 30 deg', \
     'orientation.csv' skip 1 every ::0::6 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'orientation.csv' skip 1 every ::7::12 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'yaw 60 deg', \
     'orientation.csv' skip 1 every ::7::12 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle, \
     'orientation.csv' skip 1 every ::13::15 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#009e73' title 'position 0.5 m and yaw 30 deg', \
     'orientation.csv' skip 1 every ::13::15 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#009e73' notitle, \
     'orientation.csv' skip 1 every ::16::19 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#cc79a7' title 'tilt 30 deg', \
     'orientation.csv' skip 1 every ::16::19 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#cc79a7' notitle, \
     'orientation.csv' skip 1 every ::20::20 using 2:3 with points pt 7 ps 0.9 lc rgb '#e69f00' title 'Zhao et al.: yaw 30 deg', \
     'orientation.csv' skip 1 every ::21::21 using 2:3 with points pt 7 ps 0.9 lc rgb '#56b4e9' title 'Zhao et al.: yaw 60 deg'
