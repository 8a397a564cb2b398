set encoding utf8
set terminal pngcairo noenhanced size 960,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'calibration-simulation.png'
set datafile separator comma
set title 'Predicted and actual error, simulation (medians; bars: 10th to 90th percentile)'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key top left
set xlabel 'predicted error [m]'
set logscale x
set ylabel 'actual error within 1 m of the gate [m]'
set logscale y
plot 'calibration-simulation.csv' skip 1 every ::0::19 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'prior', \
     'calibration-simulation.csv' skip 1 every ::0::19 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'calibration-simulation.csv' skip 1 every ::20::39 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'first look', \
     'calibration-simulation.csv' skip 1 every ::20::39 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle, \
     'calibration-simulation.csv' skip 1 every ::40::41 using 2:3 with lines lw 2 lc rgb '#000000' dt 2 title 'as predicted'
