set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'vehicles.png'
set datafile separator comma
set title 'Through a rate loop: vehicles'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'speed limit [m/s]'
set xrange [5.9:8.1]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'vehicles.csv' skip 1 every ::0::0 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title '370 g, thrust 3 times the weight, body rates', \
     'vehicles.csv' skip 1 every ::0::0 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'vehicles.csv' skip 1 every ::1::1 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title '370 g, thrust 3 times the weight, rotor thrusts', \
     'vehicles.csv' skip 1 every ::1::1 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle, \
     'vehicles.csv' skip 1 every ::2::2 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#009e73' title '1.3 kg, thrust twice the weight, body rates', \
     'vehicles.csv' skip 1 every ::2::2 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#009e73' notitle
