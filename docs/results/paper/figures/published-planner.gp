set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'published-planner.png'
set datafile separator comma
set title 'The planner as published'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'speed limit [m/s]'
set xrange [4.9:7.1]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'published-planner.csv' skip 1 every ::0::1 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'published planner, no perturbation', \
     'published-planner.csv' skip 1 every ::0::1 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'published-planner.csv' skip 1 every ::2::3 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'published planner, position 0.3 m', \
     'published-planner.csv' skip 1 every ::2::3 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle, \
     'published-planner.csv' skip 1 every ::4::5 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#009e73' title 'published planner, yaw 30 deg', \
     'published-planner.csv' skip 1 every ::4::5 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#009e73' notitle
