set encoding utf8
set terminal pngcairo noenhanced size 960,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'distance-simulation.png'
set datafile separator comma
set title 'Error of the centre by distance, simulation'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key top left
set xlabel 'distance [m]'
set ylabel 'error of the centre, fitted to the field alone [m]'
set logscale y
plot 'distance-simulation.csv' skip 1 every ::0::18 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'prior, median', \
     'distance-simulation.csv' skip 1 every ::19::37 using 2:3 with lines lw 2 lc rgb '#0072b2' dt 2 title 'prior, 90th percentile', \
     'distance-simulation.csv' skip 1 every ::38::56 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'first look, median', \
     'distance-simulation.csv' skip 1 every ::57::75 using 2:3 with lines lw 2 lc rgb '#d55e00' dt 2 title 'first look, 90th percentile'
